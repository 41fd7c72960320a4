"""The programs of README.md."""

import re
import runpy
from pathlib import Path

import pytest


def test_the_programs_of_the_page_run(tmp_path, monkeypatch):
    page = Path(__file__).parents[1] / "README.md"
    if not page.exists():
        pytest.skip("the page is not beside the tests")
    pytest.importorskip("pandas")
    monkeypatch.chdir(tmp_path)
    programs = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    assert len(programs) >= 5
    names: dict = {}
    for program in programs:
        exec(compile(program, "README.md", "exec"), names)
    assert names["run"].events[0].name == "wall" and names["fit"].ending == "minimum" and len(names["table"]) == 3
    assert abs(names["fit"].parameters["gamma"] - 0.3) < 1e-4


def test_the_table_of_the_page_is_written_by_a_program(tmp_path):
    pytest.importorskip("scipy")
    compare = runpy.run_path(str(Path(__file__).parents[1] / "examples" / "compare.py"))
    page = tmp_path / "README.md"
    page.write_text((Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8"), encoding="utf-8")
    lines, times = compare["compared"](compare["body"]())
    compare["write"](page, "\n".join(lines))
    written = page.read_text(encoding="utf-8")
    assert written.count(compare["BEGIN"]) == written.count(compare["END"]) == 1
    assert lines[1] in written and "ring of masses" not in written and "runs on accelerators" in written
    assert 0.0 < times["this package, dp8"] < times["SciPy, DOP853"]


def test_the_example_learns_a_friction():
    example = runpy.run_path(str(Path(__file__).parents[1] / "examples" / "learn_friction.py"))
    truth, learnt, _, losses = example["learn"](iterations=6)
    assert min(losses) < 0.3 * losses[0]
    run = learnt.run(example["STARTS"][0], t=10.0, tol=1e-8)
    assert run.certificate.keeps_energy and run.certificate.keeps_entropy and run.entropy[-1] > run.entropy[0]
    assert truth is not learnt
