use super::*;

const ONE_FALL: Certificate = Certificate {
    initial_energy: 0.5,
    max_energy_error: 1e-16,
    energy_scale: 0.5,
    initial_entropy: 1.0,
    min_entropy_increment: -2e-9,
    entropy_gained: 0.25,
    entropy_falls: 1,
    min_entropy_slope: 0.7,
    invariants: Vec::new(),
    max_manifold_defect: 0.0,
    steps: 7,
    smallest_step: 0.1,
    largest_step: 0.1,
    rejected: 0,
    falls_avoided: 0,
    projected_steps: ProjectedSteps { targeted: 0, free: 0, held: 0, stability: 0 },
    stages: None,
    effort: Effort { iterations: 9, continued: 0, splits: 1 },
    worst_iterations: 2,
    local_error: None,
    misjudged_size: None,
    rest_in_time: None,
    limiting_sites: LimitingSites::new(None, None),
    checked_states: 5,
    verified_before: false,
    promises: Promises::all_laws(true),
    second_law: SecondLaw::Exact,
    friction: 0.0,
    exchange: None,
    exchange_errors: None,
    jumps: Vec::new(),
    event_counts: Vec::new(),
    unsure_events: Vec::new(),
    events_at_start: Vec::new(),
    exchanged_in_jumps: Exchanged::NOTHING,
    noise: None,
    projected: false,
    default_friction: None,
    evaluated: Vec::new(),
};

#[test]
fn refused_steps_of_a_driven_run_ask_for_a_corner() {
    let text = |steps: usize, rejected: usize, is_open: bool| {
        let (work, heat) = (Vec::new(), Vec::new());
        let ledger = LedgerSummary { parameter: Some(0.5), work, heat, system_entropy: 0.0 };
        let exchange = is_open.then_some(ledger);
        Certificate { steps, rejected, exchange, ..ONE_FALL }.to_string()
    };
    assert!(text(11, 11, true).contains("11 rejected; if what drives it has a corner"));
    for [steps, rejected] in [[40, 11], [2, 2]] {
        assert!(!text(steps, rejected, true).contains("corner"));
    }
    assert!(text(20, 13, true).contains("corner") && !text(11, 11, false).contains("corner"));
}

#[test]
fn one_is_no_plural() {
    let text = ONE_FALL.to_string();
    for part in
        ["over 7 steps", "fell on 1 step;", "9 Newton iterations", "1 retry", "checked at 5 states"]
    {
        assert!(text.contains(part), "\"{part}\" is missing in: {text}");
    }
    assert!(!text.contains("step sizes"), "{text}");
    let adaptive = Certificate { smallest_step: 1e-3, rejected: 2, ..ONE_FALL }.to_string();
    assert!(adaptive.contains("step sizes:  1.0e-3 to 1.0e-1, 2 rejected"), "{adaptive}");
    let coarse = Certificate { local_error: Some(0.5), ..ONE_FALL };
    assert!(coarse.to_string().contains("the motion is not resolved: local errors up to 5.0e-1"));
    let size = |judged, reached| Some(MisjudgedSize { direction: 2, judged, reached });
    let grown = Certificate { misjudged_size: size(1e-3, 4.0), ..ONE_FALL }.to_string();
    assert!(grown.contains("direction 2 was estimated to have the size 1.0e-3"), "{grown}");
    let unreached = Certificate { misjudged_size: size(5e3, 4.0), ..ONE_FALL }.to_string();
    assert!(unreached.contains("it has not exceeded 4.0e0; give it a smaller one"), "{unreached}");
    assert!(!coarse.is_resolved() && ONE_FALL.is_resolved());
    let with = |surplus| {
        let stages = Some(StageBalance { surplus, ..StageBalance::default() });
        Certificate { stages, ..ONE_FALL }
    };
    let [resolved, skipped] = [with(2e-3), with(5e-3)];
    assert!(resolved.is_resolved() && !skipped.is_resolved());
    assert!(!resolved.to_string().contains("its heat"), "{resolved}");
    assert!(skipped.to_string().contains("2.0e-2 of its gain: a transient is not resolved"));
    let stiff = Certificate { friction: 1e6, ..coarse.clone() };
    assert!(stiff.is_stiff() && !stiff.is_resolved());
    assert!(!stiff.to_string().contains("not resolved"), "{stiff}");
    let with = |error, stages| {
        let certificate = Certificate { local_error: Some(error), stages, ..coarse.clone() };
        (certificate.to_string(), certificate.is_resolved())
    };
    for (error, resolved) in [(2e-3, true), (0.09, true), (0.2, false)] {
        let (text, is_resolved) = with(error, None);
        let found = text.contains("they add up") || text.contains("is not resolved");
        assert!(found && is_resolved == resolved, "{error}: {text}");
    }
    let stages = Some(StageBalance::default());
    assert!(!with(9e-3, stages).0.contains("accuracy"), "{}", with(9e-3, stages).0);
    assert!(with(0.02, stages).0.contains("inside a step"), "{}", with(0.02, stages).0);
    let some = Certificate { local_error: Some(0.02), ..coarse.clone() }.to_string();
    assert!(
        some.contains("accuracy:    local errors up to 2.0e-2 of the state in a step, and"),
        "{some}"
    );
    let fine = Certificate { local_error: Some(9e-4), ..coarse.clone() }.to_string();
    assert!(!fine.contains("accuracy"), "{fine}");
    let unknown =
        Certificate { local_error: Some(f64::INFINITY), friction: 1e6, ..coarse }.to_string();
    assert!(unknown.contains("accuracy:    not known: a step is longer than a chart"), "{unknown}");
    let text = Certificate {
        entropy_falls: 2,
        steps: 1,
        effort: Effort { iterations: 1, ..ONE_FALL.effort },
        ..ONE_FALL
    }
    .to_string();
    for part in ["over 1 step\n", "fell on 2 steps;", "1 Newton iteration ("] {
        assert!(text.contains(part), "\"{part}\" is missing in: {text}");
    }
}

#[test]
fn the_line_of_the_entropy_is_about_steps_that_were_not_targeted() {
    let with = |projected_steps, falls_avoided| {
        Certificate { projected_steps, falls_avoided, ..ONE_FALL }.to_string()
    };
    let all = ProjectedSteps { targeted: 7, ..ProjectedSteps::default() };
    assert!(!with(all, 0).contains("entropy:  "), "{}", with(all, 0));
    let free = ProjectedSteps { targeted: 6, free: 1, ..all };
    let held = ProjectedSteps { targeted: 6, held: 1, ..all };
    for text in [with(free, 0), with(held, 0), with(all, 2)] {
        assert!(text.contains("entropy:     "), "{text}");
    }
}

#[test]
fn stability_sets_the_steps_where_more_than_half_of_them_are_at_its_edge() {
    let limited = |stability| {
        let projected_steps = ProjectedSteps { stability, ..ProjectedSteps::default() };
        Certificate { projected_steps, ..ONE_FALL }.is_limited_by_stability()
    };
    assert_eq!([2, 3, 4, 7].map(limited), [false, false, true, true]);
}
