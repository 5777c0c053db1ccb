//! Everything that is the same in every wipe.

use std::path::Path;

use aforce::wiper::RoundPath;
use aforce::{ActionSpace, ControllerConfig, ForceConfig, Interpolation};
use anyhow::{Context, Result, anyhow, ensure};
use output::program::bad;
use physics::SimulationConfig;
use physics::robots::{Robot, RobotName};
use serde::{Deserialize, Serialize};
use tasks::{SensedWrench, Sensing};

use crate::spaces::{AFORCE, spaces};

/// Arm, controller, wrench sensing, and what the script does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Setup {
    /// The robot.
    pub robot: RobotName,
    /// Joints without damping and friction, no air, and a table with next to no friction (the tool's own, 0.001): what
    /// wiping then costs is the controller's own doing.
    pub lossless: bool,
    /// Force to press with (N).
    pub force: f64,
    /// Time of pressing without motion (s).
    pub press_time: f64,
    /// Circles.
    pub rotations: u32,
    /// Their radius (m).
    pub circle_radius: f64,
    /// Time of one (s).
    pub period: f64,
    /// Radius of the spot of paint (m): tracked exactly, the circles cover 0.5 cm more.
    pub spot_radius: f64,
    /// Lowest and highest contact force at which paint comes off (N).
    pub wiping_force: [f64; 2],
    /// How the external wrench is known.
    pub sensing: Sensing,
    /// Engine settings.
    pub simulation: SimulationConfig,
    /// What the spaces have in common.
    pub controller: ControllerConfig,
    /// The spaces that are compared: the first adapts, and the last is what the others are compared with.
    #[serde(rename = "space")]
    pub spaces: [ActionSpace; 4],
}

impl Default for Setup {
    fn default() -> Self {
        let RoundPath { force, press_time, rotations, circle_radius, period } = RoundPath::default();
        Setup {
            robot: RobotName::Identified,
            lossless: false,
            force,
            press_time,
            rotations,
            circle_radius,
            period,
            spot_radius: 0.07,
            wiping_force: [5.0, 60.0],
            sensing: Sensing { source: SensedWrench::Estimated, ..Sensing::default() },
            simulation: SimulationConfig::default(),
            controller: ControllerConfig {
                control_hz: 1000,
                // At most 40 cm/s and 3 rad/s on the way to the spot; the circle takes 13 cm/s.
                position_step: 0.02,
                rotation_step: 0.15,
                // Braking takes longer than an action, so that the set-point does not stop 20 times a second while it circles.
                interpolation: Interpolation::JerkLimited { dynamics: 0.15 },
                // Faster than the circle, below the limit (1 + kp) D/M = 26 1/s of the damped axis on a stiff table.
                force: ForceConfig { ki: 16.0, ..ForceConfig::default() },
                ..ControllerConfig::default()
            },
            spaces: spaces(),
        }
    }
}

impl Setup {
    /// From a file with every setting, such as the `config.toml` of an earlier run.
    ///
    /// # Errors
    /// If it cannot be read, a setting is missing or unknown, or a value is not allowed.
    pub fn read(path: &Path) -> Result<Self> {
        let text = fs_err::read_to_string(path)?;
        let setup = settings::parse(&text)
            .map_err(|problem| anyhow!("not a complete set-up: {problem}"))
            .and_then(Setup::validated);
        setup.map_err(|error| bad(format!("{}: {error:#}", path.display())))
    }

    fn validated(self) -> Result<Self> {
        let ranges = [
            ("force", self.force, 0.0..=self.controller.force.force_max),
            ("press_time", self.press_time, 0.0..=60.0),
            ("rotations", f64::from(self.rotations), 1.0..=1000.0),
            ("circle_radius", self.circle_radius, 0.0..=0.2),
            ("period", self.period, 0.1..=60.0),
            ("spot_radius", self.spot_radius, 0.01..=0.2),
        ];
        for (name, value, range) in ranges {
            aforce::within(name, value, range)?;
        }
        let [low, high] = self.wiping_force;
        ensure!(low < high, "wiping_force: {low} is not below {high}");
        self.sensing.validate().and(self.simulation.validate())?;
        self.controller.validate().map_err(|error| error.below("controller"))?;
        for space in &self.spaces {
            space.validate(self.controller.control_hz).with_context(|| space.name.clone())?;
            ensure!(space.force, "{space}: space.force = false: the script presses");
        }
        let first = &self.spaces[AFORCE];
        ensure!(first.psi().is_some(), "{first}: the first space must adapt: space.stiffness.adaptive");
        Ok(self)
    }

    /// What the script does on the table.
    pub(crate) fn path(&self) -> RoundPath {
        let Setup { force, press_time, rotations, circle_radius, period, .. } = *self;
        RoundPath { force, press_time, rotations, circle_radius, period }
    }

    /// The arm.
    pub(crate) fn arm(&self) -> Robot {
        let robot = self.robot.robot();
        if self.lossless { Robot { air: None, ..robot.with_damping(0.0).with_friction(0.0) } } else { robot }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setup_reads_back_and_a_wrong_one_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("config.toml");
        let text = toml::to_string(&Setup::default()).unwrap();
        let read = |text: String| {
            fs_err::write(&file, text).unwrap();
            Setup::read(&file).map_err(|error| format!("{error:#}"))
        };
        assert_eq!(read(text.clone()).unwrap(), Setup::default());
        for (setting, change, word) in [
            ("force = 10.0", "force = 99.0", "force"),
            ("force = 10.0", "forse = 10.0", "forse"),
            ("force = 10.0", "", "force"),
            ("bias = [0.5", "bias = [-0.5", "sensing.bias[0]"),
            ("noise = [0.3", "noise = [nan", "sensing.noise[0]"),
            ("substeps = 1", "substeps = 0", "simulation.substeps"),
            ("ki = 16.0", "ki = -1.0", "controller.force.ki"),
            ("mu = 1.0", "mu = 1e9", "stiffness.adaptive.mu"),
            ("alpha = [100.0", "alpha = [9000.0", "aforce-force: space.stiffness.adaptive.alpha"),
            ("force = true", "force = false", "aforce-force: space.force"),
        ] {
            let changed = text.replacen(setting, change, 1);
            assert_ne!(changed, text, "{setting}");
            let error = read(changed).unwrap_err();
            assert!(error.contains(word) && error.contains("config.toml"), "{error}");
        }
        let mut backwards = Setup::default();
        backwards.spaces.reverse();
        let error = read(toml::to_string(&backwards).unwrap()).unwrap_err();
        assert!(error.contains("high-force: the first space must adapt"), "{error}");
    }
}
