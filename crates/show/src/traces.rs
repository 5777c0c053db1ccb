//! What happened during one episode, over time, action by action.

use std::iter;

use tasks::{Env, Step};

use crate::plot::{Panel, Series};
use crate::recording::contact_force;

/// Time series of one episode.
#[derive(Debug, Clone, Default)]
pub struct Traces {
    time: f64,
    actions: u32,
    energy: f64,
    tool_work: [f64; 2],
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

const AXES: [&str; 3] = ["x", "y", "z"];
const JOINTS: [&str; 7] = ["joint 1", "joint 2", "joint 3", "joint 4", "joint 5", "joint 6", "joint 7"];

impl Traces {
    /// Takes in the state after one action.
    pub fn add(&mut self, env: &Env, step: &Step) {
        let rate = f64::from(env.config().controller.policy_hz);
        self.actions += 1;
        self.time += 1.0 / rate;
        self.energy += step.interval.energy.absolute;
        for (work, group) in self.tool_work.iter_mut().zip(step.interval.impedance) {
            *work += group.work;
        }
        let first = self.columns.is_empty();
        let (time, mut next) = (self.time, 0);
        let mut put = |panel, unit, label, value| {
            if first {
                self.columns.push(Column { panel, unit, label, points: vec![] });
            }
            self.columns[next].points.push((time, value));
            next += 1;
        };

        let (controller, interval) = (env.controller(), &step.interval);
        let normal = contact_force(env.simulation()).dot(&env.controller().contact_axis());
        put("Contact force", "N", "hand, mean", interval.hand.impulse / interval.time.max(f64::MIN_POSITIVE));
        put("Contact force", "N", "hand, largest", interval.hand.max);
        put("Contact force", "N", "whole arm, largest", interval.arm.max);
        put("Contact force", "N", "normal", normal);
        if controller.space().force {
            put("Contact force", "N", "requested", controller.requested_force());
            put("Contact force", "N", "desired", controller.desired_force());
        }
        let (stiffness, spring) = (controller.stiffness(), controller.feedforward_spring());
        let adapts = controller.psi().is_some();
        for (panel, unit, first) in [("Stiffness", "N/m", 0), ("Rotational stiffness", "Nm/rad", 3)] {
            for (i, axis) in AXES.into_iter().enumerate() {
                put(panel, unit, axis, stiffness[first + i]);
            }
            if adapts {
                put(panel, unit, "alpha/mu, mean", spring.fixed_rows::<3>(first).mean());
            }
        }
        let samples = f64::from(interval.samples.max(1));
        let [translation, rotation] = &interval.impedance;
        if controller.stiffness_bounds(0).is_some() {
            for (label, sum) in [
                ("translation at K_min", translation.sum_at_min),
                ("translation at K_max", translation.sum_at_max),
                ("rotation at K_min", rotation.sum_at_min),
                ("rotation at K_max", rotation.sum_at_max),
            ] {
                put("Stiffness at its bounds", "share of axes and time", label, sum / samples);
            }
        }
        for (panel, unit, group) in
            [("Force of the impedance", "N", translation), ("Moment of the impedance", "Nm", rotation)]
        {
            put(panel, unit, "spring, K e", group.sum_spring / samples);
            put(panel, unit, "damper, D e_dot", group.sum_damper / samples);
            put(panel, unit, "feed-forward, F_ff", group.sum_feedforward / samples);
        }
        for (i, axis) in AXES.into_iter().enumerate() {
            put("Position error", "mm", axis, 1000.0 * controller.error()[i]);
        }
        for (i, axis) in AXES.into_iter().enumerate() {
            put("Feed-forward force", "N", axis, controller.feedforward()[i]);
        }
        for (i, axis) in AXES.into_iter().enumerate() {
            put("Feed-forward torque", "Nm", axis, controller.feedforward()[3 + i]);
        }
        let torque = interval.mean_torque();
        for (i, joint) in JOINTS.into_iter().enumerate() {
            put("Joint torque", "Nm", joint, torque[i]);
        }
        for (i, joint) in JOINTS.into_iter().enumerate() {
            put("Joint power", "W", joint, interval.joint_work[i] * rate);
        }
        put("Joint power", "W", "sum of |tau qd|", interval.energy.absolute * rate);
        put("Energy so far", "J", "sum of |tau qd| dt", self.energy);
        put("Energy so far", "J", "of the tool's translation", self.tool_work[0]);
        put("Energy so far", "J", "of the tool's rotation", self.tool_work[1]);
        for (term, value) in step.reward_terms.iter() {
            put("Reward", "per action", term, value);
        }
        if env.config().motion_price > 0.0 {
            put("Reward", "per action", "price of motion", -step.motion_cost);
        }
        // Last, so that it is drawn over a term that equals it.
        put("Reward", "per action", "sum", step.reward);
    }

    /// Actions taken in.
    pub fn actions(&self) -> u32 {
        self.actions
    }

    /// Time since the start of the episode (s).
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Names of the columns of a table: the time, and every curve with its unit.
    pub fn names(&self) -> Vec<String> {
        let name = |column: &Column| format!("{}, {} ({})", column.panel, column.label, column.unit);
        iter::once("time (s)".to_string()).chain(self.columns.iter().map(name)).collect()
    }

    /// Its rows, one per action.
    pub fn rows(&self) -> impl Iterator<Item = Vec<f64>> {
        let times = self.columns.first().map_or(&[][..], |column| &column.points).iter().map(|point| point.0);
        times.enumerate().map(|(index, time)| {
            iter::once(time).chain(self.columns.iter().map(|column| column.points[index].1)).collect()
        })
    }

    /// One panel per quantity.
    pub fn panels(&self) -> Vec<Panel> {
        let mut panels: Vec<Panel> = vec![];
        for column in &self.columns {
            let series = Series::new(column.label, column.points.clone());
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
