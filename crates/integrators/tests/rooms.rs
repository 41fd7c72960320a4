//! The order of the rooms of this crate, read from the paths in its files.
//!
//! A room is a module of the crate, with all files below it. A file names another file in a `use` or in a path that
//! begins with `crate` or `super`; a name that a module re-exports belongs to the file that defines it, and to re-export
//! a name is not to use it. Tests inside the files are left out. A method of a type whose `impl` stands in several files is
//! not seen. The errors of all crates are read in the same way.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The rooms, each with the rooms that its files name. A room names only rooms above it.
const ROOMS: [(&str, &[&str]); 20] = [
    ("newton", &[]),
    ("step", &["newton"]),
    ("round_off", &["step"]),
    ("discrete_gradient", &["step", "round_off"]),
    ("midpoint", &["step", "round_off", "discrete_gradient", "newton"]),
    ("collocation", &["step", "round_off"]),
    ("explicit", &["step", "round_off"]),
    ("system", &["step", "round_off", "explicit"]),
    ("numbers", &["step", "round_off", "explicit", "system"]),
    (
        "implicit",
        &[
            "newton",
            "step",
            "round_off",
            "discrete_gradient",
            "midpoint",
            "collocation",
            "system",
            "numbers",
        ],
    ),
    ("typed", &["step", "discrete_gradient", "midpoint", "collocation", "numbers", "implicit"]),
    ("compiled", &["step", "explicit", "numbers", "implicit"]),
    ("run", &["step", "round_off", "numbers", "implicit", "compiled"]),
    ("noise", &["step", "explicit", "numbers"]),
    (
        "open",
        &[
            "step",
            "round_off",
            "discrete_gradient",
            "midpoint",
            "collocation",
            "explicit",
            "system",
            "numbers",
            "implicit",
            "noise",
        ],
    ),
    ("default_scheme", &["step", "midpoint"]),
    ("attitude", &["round_off", "run"]),
    (
        "tangent",
        &[
            "step",
            "round_off",
            "discrete_gradient",
            "midpoint",
            "collocation",
            "explicit",
            "system",
            "numbers",
            "implicit",
            "compiled",
            "run",
            "noise",
            "open",
        ],
    ),
    ("error", &["step", "explicit", "implicit", "run", "noise", "open", "attitude", "tangent"]),
    ("laws", &["step", "round_off", "discrete_gradient", "midpoint", "explicit", "run"]),
];

/// The files that name each other, all of them pairs: a default and what it is computed from, an equation and its
/// covectors.
const PAIRS: [[&str; 2]; 2] = [
    ["step::flow", "step::initial_scales"],
    ["midpoint::equation", "midpoint::equation::providers"],
];

/// The files by their modules, without comments, texts and tests.
type Files = BTreeMap<String, String>;

/// The files that each file names.
type Graph = BTreeMap<String, BTreeSet<String>>;

#[test]
fn a_room_names_only_the_rooms_that_stand_before_it() {
    let graph = graph(&files());
    let mut named: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for (file, others) in &graph {
        // What is found in the root itself is an exported macro, which stands there wherever it is written.
        let others = others.iter().map(|other| room(other));
        let rooms = others.filter(|other| *other != room(file) && *other != "lib");
        named.entry(room(file)).or_default().extend(rooms);
    }
    named.remove("lib");
    for (index, (name, known)) in ROOMS.iter().enumerate() {
        let found = named.remove(name).unwrap_or_else(|| panic!("there is no room {name}"));
        assert_eq!(found, known.iter().copied().collect(), "what {name} names");
        let before: Vec<&str> = ROOMS[..index].iter().map(|(name, _)| *name).collect();
        assert!(known.iter().all(|room| before.contains(room)), "{name} names a later room");
    }
    assert!(named.is_empty(), "rooms without a place: {named:?}");
}

#[test]
fn files_of_a_room_form_no_circle_but_pairs() {
    let graph = graph(&files());
    assert_eq!(circles(&graph), PAIRS.iter().map(|pair| pair.to_vec()).collect());
}

#[test]
fn files_of_no_crate_form_a_circle_of_three() {
    for (name, files) in crates() {
        let graph = graph(&files);
        for circle in circles(&graph) {
            assert!(circle.len() <= 2, "{name}: {circle:?}");
        }
    }
}

/// The sources of each crate, except the tools of the figures.
fn crates() -> BTreeMap<String, Files> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the folder of the crates");
    let sources = |entry: fs::DirEntry| {
        let (root, mut files) = (entry.path().join("src"), Files::new());
        read_folder(&root, &root, &mut files);
        (entry.file_name().to_string_lossy().into_owned(), files)
    };
    let entries = fs::read_dir(folder).expect("the crates");
    let mut crates: BTreeMap<_, _> =
        entries.map(|entry| sources(entry.expect("a crate"))).collect();
    crates.remove("studies");
    assert!(crates.len() > 8, "{} crates", crates.len());
    crates
}

/// The types in a file that derive `Error`, each with what it derives and whether it is public.
fn errors(text: &str) -> Vec<(String, String, bool)> {
    let lines: Vec<&str> = text.lines().collect();
    let derives = lines.iter().enumerate().filter_map(|(k, line)| {
        let derived = line.strip_prefix("#[derive(")?.strip_suffix(")]")?;
        derived.ends_with("Error").then_some((k, derived))
    });
    let typed = |(k, derived): (usize, &str)| {
        let head =
            lines[k..].iter().find(|line| line.contains("enum ") || line.contains("struct "));
        let head = head.expect("a type");
        let name =
            head.split(['<', '(', ';', '{']).next().and_then(|head| head.split_whitespace().last());
        (name.expect("a name").to_owned(), derived.to_owned(), head.starts_with("pub "))
    };
    derives.map(typed).collect()
}

/// A `main` that returns an error prints its `Debug` form, and `?` in it makes an `Error` of each.
#[test]
fn every_error_prints_its_sentence_and_is_passed_on() {
    let crates = crates();
    let code: Vec<&String> = crates.values().flat_map(BTreeMap::values).collect();
    let passed_on = |name: &str| {
        let ways = [format!("(#[from] {name})"), format!("From<{name}>"), format!("From<{name}<")];
        let lists = code.iter().flat_map(|text| text.split("passed_on_as_error!(").skip(1));
        let mut listed = lists.filter_map(|list| list.split(')').next());
        code.iter().any(|text| ways.iter().any(|way| text.contains(way)))
            || listed
                .any(|list| list.split(|c: char| !c.is_alphanumeric()).any(|word| word == name))
    };
    let mut count = 0;
    for (name, files) in &crates {
        for (module, text) in files {
            for (error, derived, public) in errors(text) {
                assert!(!derived.contains("Debug"), "{name}/{module}: {error} derives Debug");
                let macros = text.split("debug_is_the_sentence!(").skip(1);
                let mut printed = macros.filter_map(|list| list.split(");").next());
                let words = |list: &str| list.split(['<', ' ', ']']).any(|word| word == error);
                assert!(printed.any(words), "{name}/{module}: {error} prints no sentence");
                assert!(
                    !public || error == "Error" || passed_on(&error),
                    "{name}/{module}: {error} is no `Error`"
                );
                count += 1;
            }
        }
    }
    assert!(count > 35, "{count} errors");
}

/// The sets of files of which each reaches the others.
fn circles(graph: &Graph) -> BTreeSet<Vec<&str>> {
    let reached: BTreeMap<&str, BTreeSet<&str>> =
        graph.keys().map(|file| (file.as_str(), reached_from(file, graph))).collect();
    let mut circles = BTreeSet::new();
    for (file, there) in &reached {
        let back = there.iter().filter(|other| reached[*other].contains(file));
        circles.insert(back.copied().collect::<Vec<_>>());
    }
    circles.remove(&Vec::new());
    circles
}

/// The first name of a module.
fn room(module: &str) -> &str {
    module.split("::").next().unwrap_or(module)
}

/// The files that can be reached from one by one name or more.
fn reached_from<'a>(file: &str, graph: &'a Graph) -> BTreeSet<&'a str> {
    let mut reached = BTreeSet::new();
    let mut next: Vec<&str> = graph[file].iter().map(String::as_str).collect();
    while let Some(file) = next.pop() {
        if reached.insert(file) {
            next.extend(graph[file].iter().map(String::as_str));
        }
    }
    reached
}

fn graph(files: &Files) -> Graph {
    let others = |file: &String, text: &String| {
        let [_, paths] = paths(text);
        let others = paths.into_iter().filter_map(|path| resolved(files, file, &path));
        (file.clone(), others.filter(|other| other != file).collect())
    };
    files.iter().map(|(file, text)| others(file, text)).collect()
}

/// The file that a path in a module belongs to; `None` for the paths of other crates.
fn resolved(files: &Files, module: &str, path: &[String]) -> Option<String> {
    let mut place: Vec<&str> =
        if module == "lib" { Vec::new() } else { module.split("::").collect() };
    let mut rest = path;
    match rest.first()?.as_str() {
        "crate" => {
            place.clear();
            rest = &rest[1..];
        }
        "self" => rest = &rest[1..],
        "super" => {
            while rest.first().is_some_and(|name| name == "super") {
                place.pop();
                rest = &rest[1..];
            }
        }
        // A child of the module.
        name if files.contains_key(&[module, name].join("::")) => {}
        _ => return None,
    }
    while let Some((name, after)) = rest.split_first() {
        place.push(name);
        if !files.contains_key(&place.join("::")) {
            place.pop();
            break;
        }
        rest = after;
    }
    let here = if place.is_empty() { "lib".to_owned() } else { place.join("::") };
    let Some(name) = rest.first().filter(|_| here != module) else { return Some(here) };
    // The file that defines what this module re-exports.
    let [exports, _] = paths(&files[&here]);
    let exported = exports.into_iter().find(|path| path.last() == Some(name));
    Some(exported.and_then(|path| resolved(files, &here, &path)).unwrap_or(here))
}

/// The paths that a file names: those of its `pub use`, and the others.
fn paths(text: &str) -> [Vec<Vec<String>>; 2] {
    let (mut exports, mut others) = (Vec::new(), Vec::new());
    let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    for statement in text.split(';') {
        let (before, tree) = match statement.split_once("use ") {
            Some((before, tree)) => (before, Some(tree)),
            None => (statement, None),
        };
        for path in before.split(|c| !is_part(c)) {
            if path.starts_with("crate::") || path.starts_with("super::") {
                others.push(path.split("::").map(str::to_owned).collect());
            }
        }
        if let Some(tree) = tree {
            let exported = before.lines().last().is_some_and(|line| line.contains("pub"));
            leaves(&[], tree.trim(), if exported { &mut exports } else { &mut others });
        }
    }
    [exports, others]
}

/// The leaves of a tree `a::{b, c::d}`.
fn leaves(before: &[String], tree: &str, paths: &mut Vec<Vec<String>>) {
    let (path, group) = match tree.find('{') {
        Some(open) => (&tree[..open], tree[open + 1..].strip_suffix('}')),
        None => (tree, None),
    };
    let path = path.split(" as ").next().unwrap_or_default();
    let names = path.split("::").map(str::trim).filter(|name| !name.is_empty());
    let path: Vec<String> = before.iter().cloned().chain(names.map(str::to_owned)).collect();
    let Some(group) = group else { return paths.push(path) };
    let (mut depth, mut start) = (0, 0);
    for (at, c) in group.char_indices().chain([(group.len(), ',')]) {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                let leaf = group[start..at].trim();
                if !leaf.is_empty() {
                    leaves(&path, leaf, paths);
                }
                start = (at + 1).min(group.len());
            }
            _ => {}
        }
    }
}

fn files() -> Files {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Files::new();
    read_folder(&root, &root, &mut files);
    assert!(files.len() > 50, "{} files", files.len());
    files
}

fn read_folder(root: &Path, folder: &Path, files: &mut Files) {
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path: PathBuf = entry.expect("an entry").path();
        if path.is_dir() {
            read_folder(root, &path, files);
        } else if path.file_name().is_some_and(|name| name != "tests.rs") {
            let module = path.strip_prefix(root).expect("below the root").with_extension("");
            let names = module.iter().map(|name| name.to_string_lossy()).collect::<Vec<_>>();
            files.insert(names.join("::"), code(&fs::read_to_string(&path).expect("a source")));
        }
    }
}

/// The code of a file, without its comments, its texts in quotes and the tests at its end.
fn code(text: &str) -> String {
    let tests = ["#[cfg(test)]\nmod tests", "#[cfg(all(test"].into_iter();
    let end = tests.filter_map(|start| text.find(start)).min().unwrap_or(text.len());
    let mut code = String::new();
    for line in text[..end].lines() {
        let line = line.split("//").next().unwrap_or_default();
        code.extend(line.split('"').step_by(2));
        code.push('\n');
    }
    code
}

#[test]
fn a_path_is_found_wherever_it_stands() {
    let text = "pub use crate::z::Z;\nuse crate::a::{self, b::C, d as e};\nfn f() -> super::g::H { crate::i::J }";
    let text = format!("{text}\n// use crate::a::B;\n#[cfg(test)]\nmod tests {{ use super::C; }}");
    let [exports, others] = paths(&code(&text))
        .map(|paths| paths.iter().map(|path| path.join("::")).collect::<Vec<_>>());
    assert_eq!(exports, ["crate::z::Z"]);
    assert_eq!(
        others,
        ["crate::a::self", "crate::a::b::C", "crate::a::d", "super::g::H", "crate::i::J"]
    );
}
