//! Numbers that others published, to stand beside ours.

/// What a publication says of a task and an action space.
pub struct Published {
    /// Task.
    pub task: &'static str,
    /// Action space, by the name it has here.
    pub space: &'static str,
    /// Final return: mean and deviation over seeds.
    pub final_return: [f64; 2],
    /// Energy per action during training (J), where it is given. Not the same definition as ours, and not stated which:
    /// compare ratios.
    pub energy_per_action_j: Option<f64>,
}

const fn row(task: &'static str, space: &'static str, final_return: [f64; 2], energy: Option<f64>) -> Published {
    Published { task, space, final_return, energy_per_action_j: energy }
}

/// The AFORCE paper (arXiv 2110.09904), Table I. Its Wipe policies of `aforce` also command a force.
pub const PAPER: [Published; 8] = [
    row("door", "aforce", [456.0, 20.0], Some(7.0)),
    row("door", "variable", [242.0, 227.0], Some(131.0)),
    row("lift", "aforce", [480.0, 1.0], Some(1.5)),
    row("lift", "variable", [363.0, 66.0], Some(24.5)),
    row("wipe", "aforce-force", [437.0, 24.0], Some(1.8)),
    row("wipe", "variable", [178.0, 38.0], Some(27.0)),
    row("wipe", "variable-force", [178.0, 48.0], None),
    row("wipe", "low-force", [264.0, 73.0], None),
];

/// robosuite's benchmark (ARISE-Initiative/robosuite-benchmark, Panda, OSC_POSE, SAC) after 300 000 steps: mean and
/// deviation over five seeds.
pub const BENCHMARK: [Published; 3] = [
    row("door", "osc", [435.0, 17.0], None),
    row("lift", "osc", [227.0, 57.0], None),
    row("wipe", "osc", [32.0, 15.0], None),
];

/// What is published of a task and an action space, if anything, and by whom.
pub fn of(task: &str, space: &str) -> Option<(&'static str, &'static Published)> {
    let find = |table: &'static [Published]| table.iter().find(|row| row.task == task && row.space == space);
    find(&PAPER).map(|row| ("paper", row)).or_else(|| find(&BENCHMARK).map(|row| ("robosuite", row)))
}
