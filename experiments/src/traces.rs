//! What happened during one episode, over time, at 20 Hz.

use tasks::{Env, Step};

use output::plot::{Panel, Series};

/// Time series of one episode.
#[derive(Debug, Clone, Default)]
pub struct Traces {
    time: f64,
    actions: u32,
    columns: Vec<Column>,
}

/// One curve.
#[derive(Debug, Clone)]
struct Column {
    panel: &'static str,
    unit: &'static str,
    label: &'static str,
    points: Vec<(f64, f64)>,
}

impl Traces {
    /// Takes in the state after one action.
    pub fn add(&mut self, env: &Env, step: &Step) {
        self.actions += 1;
        self.time += 1.0 / f64::from(env.config().controller.policy_hz);
        let controller = env.controller();
        let error = controller.error();
        let unit = controller.own_stiffness();
        let interval = &step.interval;
        let power = interval.energy.absolute * f64::from(env.config().controller.policy_hz);
        let rows = [
            ("Contact force", "N", "mean, sustained", interval.mean_force()),
            ("Contact force", "N", "largest, sustained", interval.max_force),
            ("Stiffness, the space's own unit", "1/s2 or N/m", "x", unit[0]),
            ("Stiffness, the space's own unit", "1/s2 or N/m", "y", unit[1]),
            ("Stiffness, the space's own unit", "1/s2 or N/m", "z", unit[2]),
            ("Position error", "mm", "x", 1000.0 * error[0]),
            ("Position error", "mm", "y", 1000.0 * error[1]),
            ("Position error", "mm", "z", 1000.0 * error[2]),
            ("Feed-forward force", "N", "x", controller.feedforward()[0]),
            ("Feed-forward force", "N", "y", controller.feedforward()[1]),
            ("Feed-forward force", "N", "z", controller.feedforward()[2]),
            ("Joint power", "W", "sum of |tau qd|", power),
            ("Reward", "per action", "reward", step.reward),
        ];
        if self.columns.is_empty() {
            let column = |&(panel, unit, label, _): &_| Column { panel, unit, label, points: vec![] };
            self.columns = rows.iter().map(column).collect();
        }
        for (column, row) in self.columns.iter_mut().zip(rows) {
            column.points.push((self.time, row.3));
        }
    }

    /// Actions taken in.
    pub fn actions(&self) -> u32 {
        self.actions
    }

    /// Time since the start of the episode (s).
    pub fn time(&self) -> f64 {
        self.time
    }

    /// One panel per quantity.
    pub fn panels(&self) -> Vec<Panel> {
        let mut panels: Vec<Panel> = vec![];
        for column in &self.columns {
            let series = Series { label: column.label.into(), points: column.points.clone() };
            match panels.last_mut().filter(|p| p.title == column.panel) {
                Some(panel) => panel.series.push(series),
                None => panels.push(Panel {
                    title: column.panel.into(),
                    x_label: "time (s)".into(),
                    y_label: column.unit.into(),
                    series: vec![series],
                    ..Panel::default()
                }),
            }
        }
        panels
    }
}
