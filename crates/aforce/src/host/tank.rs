//! An energy tank: it bounds the energy that the law's active parts put into the arm.

use serde::{Deserialize, Serialize};

use crate::error::{ConfigError, not_negative, within};

/// Size of the tank. With `initial` and `capacity` infinite there is no bound.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TankConfig {
    /// Energy at the start (J).
    pub initial: f64,
    /// Largest energy that the tank keeps (J).
    pub capacity: f64,
    /// Level below which the active parts fade (J).
    pub low: f64,
}

impl Default for TankConfig {
    /// 2 J at the start: a spring of 3000 N/m that is stretched by 3 cm holds 1.35 J.
    fn default() -> Self {
        Self { initial: 2.0, capacity: 5.0, low: 0.5 }
    }
}

impl TankConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        not_negative("tank.low", self.low)?;
        within("tank.initial", self.initial, 0.0..=f64::INFINITY)?;
        within("tank.capacity", self.capacity, self.initial..=f64::INFINITY)
    }
}

/// The running tank (Ferraguti et al. 2013 for stiffness, Schindlbeck and Haddadin 2015 for force): the damper fills it, and
/// so does work that the environment does against an active part; growth of K at an error, and the work of F_ff and F_cmd,
/// drain it. The level never falls below zero, because the active parts act only in the share that the tank can pay
/// for.
#[derive(Debug, Clone)]
pub(crate) struct Tank {
    config: TankConfig,
    level: f64,
}

impl Tank {
    pub(crate) fn new(config: TankConfig) -> Self {
        Self { config, level: config.initial }
    }

    /// Energy in the tank (J).
    pub(crate) fn level(&self) -> f64 {
        self.level
    }

    /// The share, 0 to 1, in which the active parts may act in this sample. `costs` (J) is what they would cost in full. A negative cost is
    /// a gain and does not count.
    pub(crate) fn share(&self, costs: &[f64]) -> f64 {
        let cost = expense(costs);
        // The valve is 1 while the level is at least `low`, and falls with the level below. A cost above the level is first reduced to the
        // level.
        let valve = if self.level >= self.config.low { 1.0 } else { self.level / self.config.low };
        if cost > self.level { valve * self.level / cost } else { valve }
    }

    /// Takes the costs (J) of parts that acted in `share` from the tank. Gains do not count: [`fill`](Self::fill) adds
    /// what came back.
    pub(crate) fn pay(&mut self, costs: &[f64], share: f64) {
        self.fill(-share * expense(costs));
    }

    /// Adds energy that was taken from the arm (J). A negative `energy` drains the tank.
    pub(crate) fn fill(&mut self, energy: f64) {
        self.level = (self.level + energy).max(0.0).min(self.config.capacity);
    }
}

/// Sum of the costs without the gains among them (J).
fn expense(costs: &[f64]) -> f64 {
    costs.iter().map(|cost| cost.max(0.0)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn tank() -> Tank {
        Tank::new(TankConfig { initial: 1.0, capacity: 2.0, low: 0.5 })
    }

    #[test]
    fn by_hand() {
        let mut tank = tank();
        let costs = [0.3, -0.1];
        assert_eq!(tank.share(&costs), 1.0);
        tank.pay(&costs, 1.0);
        assert!((tank.level() - 0.7).abs() < 1e-12);
        tank.pay(&[0.5], 1.0);
        assert!((tank.share(&[0.0]) - 0.4).abs() < 1e-12, "0.2 of 0.5 J are left");
        assert!((tank.share(&[0.8]) - 0.4 * 0.25).abs() < 1e-12, "and 0.8 J are four times what there is");
        tank.fill(7.0);
        assert_eq!(tank.level(), 2.0);
    }

    #[test]
    fn an_infinite_tank_bounds_nothing() {
        let endless = TankConfig { initial: f64::INFINITY, capacity: f64::INFINITY, low: 0.0 };
        endless.validate().unwrap();
        let mut tank = Tank::new(endless);
        tank.pay(&[1e6], 1.0);
        assert_eq!(tank.share(&[1e9]), 1.0);
    }

    proptest! {
        #[test]
        fn more_is_never_paid_than_there_was(costs in prop::collection::vec(prop::array::uniform3(-0.2..0.4f64), 1..200)) {
            let mut tank = tank();
            let mut net = 1.0; // Initial level, less what was paid.
            for cost in costs {
                let share = tank.share(&cost);
                prop_assert!((0.0..=1.0).contains(&share));
                let before = tank.level();
                tank.pay(&cost, share);
                net -= share * expense(&cost);
                prop_assert!(tank.level() >= 0.0 && tank.level() <= 2.0);
                // Paying takes at least the expense, and the level never exceeds the initial level less all expenses.
                prop_assert!(tank.level() <= before - share * expense(&cost) + 1e-12);
                prop_assert!(tank.level() <= net.max(0.0) + 1e-9);
            }
        }
    }
}
