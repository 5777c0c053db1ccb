//! Numbers that others published, to stand beside ours.

/// What a publication says of a task and an action space.
pub struct Published {
    /// Task.
    pub task: &'static str,
    /// Action space, by the name it has here.
    pub space: &'static str,
    /// Final return: mean and deviation over seeds.
    pub final_return: [f64; 2],
    /// Energy per action during training (J), where it is given. Its definition is not stated and is not ours: only
    /// ratios can be compared.
    pub energy_per_action_j: Option<f64>,
    /// Share of training episodes with a penalty, as it is given: some are bounds.
    pub penalised_episode_share: Option<&'static str>,
    /// Penalty per training episode, as it is given: some are bounds.
    pub penalty_per_episode: Option<&'static str>,
}

impl Published {
    const fn new(task: &'static str, space: &'static str, final_return: [f64; 2]) -> Self {
        Published {
            task,
            space,
            final_return,
            energy_per_action_j: None,
            penalised_episode_share: None,
            penalty_per_episode: None,
        }
    }

    const fn energy(self, per_action_j: f64) -> Self {
        Published { energy_per_action_j: Some(per_action_j), ..self }
    }

    const fn penalised(self, episode_share: &'static str) -> Self {
        Published { penalised_episode_share: Some(episode_share), ..self }
    }

    const fn penalty(self, per_episode: &'static str) -> Self {
        Published { penalty_per_episode: Some(per_episode), ..self }
    }
}

/// The AFORCE paper (arXiv 2110.09904), Table I and the text on penalties. Its Wipe policies of `aforce` also command a
/// force.
pub const PAPER: [Published; 8] = [
    Published::new("door", "aforce", [456.0, 20.0]).energy(7.0).penalty("25"),
    Published::new("door", "variable", [242.0, 227.0]).energy(131.0).penalty("149"),
    Published::new("lift", "aforce", [480.0, 1.0]).energy(1.5),
    Published::new("lift", "variable", [363.0, 66.0]).energy(24.5),
    Published::new("wipe", "aforce-force", [437.0, 24.0]).energy(1.8).penalised("0.12").penalty("17.8"),
    Published::new("wipe", "variable", [178.0, 38.0]).energy(27.0).penalised("above 0.75").penalty("above 400"),
    Published::new("wipe", "variable-force", [178.0, 48.0]).energy(19.5),
    Published::new("wipe", "low-force", [264.0, 73.0]).energy(1.0).penalty("17.2"),
];

/// robosuite's benchmark (ARISE-Initiative/robosuite-benchmark, Panda, OSC_POSE, SAC) after 300 000 steps: mean and
/// deviation over five seeds.
pub const BENCHMARK: [Published; 3] = [
    Published::new("door", "osc", [435.0, 17.0]),
    Published::new("lift", "osc", [227.0, 57.0]),
    Published::new("wipe", "osc", [32.0, 15.0]),
];

/// What is published of a task and an action space, if anything, and by whom.
pub fn of(task: &str, space: &str) -> Option<(&'static str, &'static Published)> {
    let find = |table: &'static [Published]| table.iter().find(|row| row.task == task && row.space == space);
    find(&PAPER).map(|row| ("paper", row)).or_else(|| find(&BENCHMARK).map(|row| ("robosuite", row)))
}
