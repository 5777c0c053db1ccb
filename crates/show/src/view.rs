//! Camera presets.

use physics::camera::Camera;

/// Camera presets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum View {
    /// The task's own.
    #[default]
    Task,
    /// From in front of the robot.
    Front,
    /// From the robot's right.
    Side,
    /// From above, the robot at the top.
    Top,
}

impl View {
    /// All presets.
    pub const ALL: [View; 4] = [View::Task, View::Front, View::Side, View::Top];

    /// Name on buttons.
    pub fn name(self) -> &'static str {
        match self {
            View::Task => "Task",
            View::Front => "Front",
            View::Side => "Side",
            View::Top => "Top",
        }
    }

    /// Name on command lines, and what is seen.
    pub fn option(self) -> (&'static str, &'static str) {
        match self {
            View::Task => ("task", "The task's own"),
            View::Front => ("front", "From in front of the robot"),
            View::Side => ("side", "From the robot's right"),
            View::Top => ("top", "From above, the robot at the top"),
        }
    }

    /// The preset's camera, with target and distance of `camera`, the task's own.
    pub fn of(self, camera: &Camera) -> Camera {
        match self {
            View::Task => *camera,
            View::Front => camera.from_direction([1.0, 0.0, 0.35]),
            View::Side => camera.from_direction([0.0, -1.0, 0.35]),
            View::Top => camera.from_direction([0.001, 0.0, 1.0]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_view_has_one_name_of_its_own_on_buttons_and_command_lines() {
        let names = View::ALL.map(|view| view.option().0);
        assert_eq!(names.map(String::from), View::ALL.map(|view| view.name().to_lowercase()));
        assert!((1..names.len()).all(|at| !names[..at].contains(&names[at])), "{names:?}");
    }
}
