//! The settings of an environment.

use aforce::record;
use aforce::{ActionSpace, ConfigError, ControllerConfig, within};
use physics::SimulationConfig;
use physics::robots::RobotChoice;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use toml::Table;

use crate::disturbance::Disturbance;
use crate::observation_options::ObservationOptions;
use crate::penalty::ForcePenalty;
use crate::protection::Protection;
use crate::sensing::Sensing;
use crate::task_name::TaskName;

/// Everything that defines an environment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EnvConfig {
    /// The task.
    pub task: TaskName,
    /// The action space.
    pub space: ActionSpace,
    /// The robot: its kinematics, inertia, limits and shapes.
    pub robot: RobotChoice,
    /// Actions until an episode is truncated. Door's penalty and all of Wipe's reward are scaled with it.
    pub horizon: u32,
    /// Standard deviation of the joint angles around the task's start at reset (rad). Angles out of range, and those with which
    /// the arm would overlap its surroundings by a millimetre, are drawn anew.
    pub initial_noise: f64,
    /// Reward lost per joule of sum |tau qd| dt, in every task; 0: motion is free.
    pub motion_price: f64,
    /// Whether an episode ends once the task has stood fulfilled for a second. To the learner it is cut short there: its
    /// value goes on.
    pub ends_on_success: bool,
    /// Whether an episode ends where a real arm would have stopped itself: its last action earns nothing but what motion costs,
    /// and to the learner the state it ends in is worth nothing. Without it the tables tell when that would have been.
    pub stops: bool,
    /// What a stop costs (reward). With it the episode is cut short where the arm stops, and to the learner its value goes on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop_price: Option<f64>,
    /// What makes a real arm stop itself.
    pub protection: Protection,
    /// What the task itself defines, as Insert does ([`EnvConfig::own_options`]).
    #[serde(skip_serializing_if = "Table::is_empty")]
    pub options: Table,
    /// What the policy sees beyond robosuite's observation.
    pub observation: ObservationOptions,
    /// Force limit and penalty.
    pub force_penalty: ForcePenalty,
    /// What differs from what controller and policy know.
    pub disturbance: Disturbance,
    /// How the external wrench is known.
    pub sensing: Sensing,
    /// Engine settings.
    pub simulation: SimulationConfig,
    /// The controller.
    pub controller: ControllerConfig,
}

impl EnvConfig {
    /// The options below `env.options` as the task's own type. An absent key has the type's default if the type is
    /// `#[serde(default)]`. The type should be `deny_unknown_fields`, so that a misspelt key is an error.
    ///
    /// # Errors
    /// If a key is missing, unknown or of the wrong type.
    pub fn own_options<T: DeserializeOwned>(&self) -> Result<T, ConfigError> {
        record::read(self.options.clone())
            .map_err(|problem| ConfigError::Contradiction { field: "env.options".into(), reason: problem.to_string() })
    }

    /// Checks every value that means the same in every task.
    ///
    /// # Errors
    /// The first value that is not allowed, with its field and range.
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        let ForcePenalty { limit, weight, .. } = self.force_penalty;
        within("env.horizon", f64::from(self.horizon), 1.0..=1e6)?;
        within("env.initial_noise", self.initial_noise, 0.0..=0.5)?;
        within("env.force_penalty.limit", limit, 0.0..=1e6)?;
        within("env.force_penalty.weight", weight, 0.0..=1e3)?;
        within("env.motion_price", self.motion_price, 0.0..=1e3)?;
        if let Some(price) = self.stop_price {
            within("env.stop_price", price, 0.0..=1e3)?;
            if !self.stops {
                let reason = "a stop costs nothing while nothing stops the arm: env.stops = true is missing".into();
                return Err(ConfigError::Contradiction { field: "env.stop_price".into(), reason });
            }
        }
        if let RobotChoice::Own(robot) = &self.robot {
            robot.validate().map_err(|error| error.below("env.robot"))?;
        }
        self.protection.validate().map_err(|error| error.below("env"))?;
        self.observation.validate().map_err(|error| error.below("env"))?;
        // A push above half the control rate aliases: its samples are those of a slower push or of a constant force.
        let push_hz = self.disturbance.push_hz.map_or(0.0, |draw| draw.ends()[1]);
        within("env.disturbance.push_hz", push_hz, 0.0..=f64::from(self.controller.control_hz) / 2.0)?;
        self.sensing.validate().map_err(|error| error.below("env"))?;
        self.simulation.validate().map_err(|error| error.below("env"))?;
        self.controller.validate().map_err(|error| error.below("env.controller"))?;
        self.space.validate(self.controller.control_hz).map_err(|error| error.below("env"))
    }
}

impl Default for EnvConfig {
    fn default() -> Self {
        EnvConfig {
            task: TaskName::default(),
            space: "aforce".parse().expect("a built-in space"),
            robot: RobotChoice::default(),
            horizon: 500,
            initial_noise: 0.02,
            motion_price: 0.0,
            ends_on_success: false,
            stops: false,
            stop_price: None,
            protection: Protection::default(),
            options: Table::new(),
            observation: ObservationOptions::default(),
            force_penalty: ForcePenalty::default(),
            disturbance: Disturbance::default(),
            sensing: Sensing::default(),
            simulation: SimulationConfig::default(),
            controller: ControllerConfig::default(),
        }
    }
}
