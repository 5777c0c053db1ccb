//! Time series of one episode, with a value per action.

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

impl Traces {
    /// Adds the state after one action.
    pub fn add(&mut self, env: &Env, step: &Step) {
        self.actions += 1;
        self.time += 1.0 / f64::from(env.config().controller.policy_hz);
        self.energy += step.interval.energy.absolute;
        for (work, group) in self.tool_work.iter_mut().zip(step.interval.impedance) {
            *work += group.work;
        }
        let mut row = Row::default();
        row.add_forces(env, step);
        row.add_stiffness(env, step);
        row.add_impedance(step);
        row.add_errors(env);
        row.add_joints(env, step);
        row.put("Energy so far", "J", "sum of |tau qd| dt", self.energy);
        row.put("Energy so far", "J", "of the tool's translation", self.tool_work[0]);
        row.put("Energy so far", "J", "of the tool's rotation", self.tool_work[1]);
        row.add_reward(env, step);
        if self.columns.is_empty() {
            self.columns = row.0.iter().map(|(column, _)| column.clone()).collect();
        }
        for (at, (_, value)) in row.0.into_iter().enumerate() {
            self.columns[at].points.push((self.time, value));
        }
    }

    /// Number of actions so far.
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

    /// Rows of this table, one per action.
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

const AXES: [&str; 3] = ["x", "y", "z"];
const JOINTS: [&str; 7] = ["joint 1", "joint 2", "joint 3", "joint 4", "joint 5", "joint 6", "joint 7"];

/// What one action adds to the curves. An episode's actions have the same curves in the same order.
#[derive(Default)]
struct Row(Vec<(Column, f64)>);

impl Row {
    fn put(&mut self, panel: &'static str, unit: &'static str, label: &'static str, value: f64) {
        self.0.push((Column { panel, unit, label, points: vec![] }, value));
    }

    /// A curve per axis.
    fn put_axes(&mut self, panel: &'static str, unit: &'static str, value: impl Fn(usize) -> f64) {
        for (i, axis) in AXES.into_iter().enumerate() {
            self.put(panel, unit, axis, value(i));
        }
    }

    /// A curve per joint of the arm, which may have six.
    fn put_joints(&mut self, env: &Env, panel: &'static str, unit: &'static str, value: impl Fn(usize) -> f64) {
        for (i, joint) in JOINTS.into_iter().enumerate().take(env.robot().joints) {
            self.put(panel, unit, joint, value(i));
        }
    }

    fn add_forces(&mut self, env: &Env, step: &Step) {
        let (controller, interval) = (env.controller(), &step.interval);
        let mean = interval.hand.impulse / interval.time.max(f64::MIN_POSITIVE);
        let normal = contact_force(env.simulation()).dot(&controller.contact_axis());
        let mut put = |label, value| self.put("Contact force", "N", label, value);
        put("hand, mean", mean);
        put("hand, largest", interval.hand.max);
        put("whole arm, largest", interval.arm.max);
        put("normal", normal);
        if controller.space().force {
            put("requested", controller.requested_force());
            put("desired", controller.desired_force());
        }
    }

    fn add_stiffness(&mut self, env: &Env, step: &Step) {
        let controller = env.controller();
        let (stiffness, spring) = (controller.stiffness(), controller.feedforward_spring());
        for (panel, unit, first) in [("Stiffness", "N/m", 0), ("Rotational stiffness", "Nm/rad", 3)] {
            self.put_axes(panel, unit, |i| stiffness[first + i]);
            if controller.psi().is_some() {
                self.put(panel, unit, "alpha/mu, mean", spring.fixed_rows::<3>(first).mean());
            }
        }
        if controller.stiffness_bounds(0).is_some() {
            let [translation, rotation] = &step.interval.impedance;
            for (label, sum) in [
                ("translation at K_min", translation.sum_at_min),
                ("translation at K_max", translation.sum_at_max),
                ("rotation at K_min", rotation.sum_at_min),
                ("rotation at K_max", rotation.sum_at_max),
            ] {
                self.put("Stiffness at its bounds", "share of axes and time", label, sum / samples(step));
            }
        }
    }

    fn add_impedance(&mut self, step: &Step) {
        let [translation, rotation] = &step.interval.impedance;
        for (panel, unit, group) in
            [("Force of the impedance", "N", translation), ("Moment of the impedance", "Nm", rotation)]
        {
            self.put(panel, unit, "spring, K e", group.sum_spring / samples(step));
            self.put(panel, unit, "damper, D e_dot", group.sum_damper / samples(step));
            self.put(panel, unit, "feed-forward, F_ff", group.sum_feedforward / samples(step));
        }
    }

    /// The position error and the feed-forward wrench.
    fn add_errors(&mut self, env: &Env) {
        let controller = env.controller();
        self.put_axes("Position error", "mm", |i| 1000.0 * controller.error()[i]);
        self.put_axes("Feed-forward force", "N", |i| controller.feedforward()[i]);
        self.put_axes("Feed-forward torque", "Nm", |i| controller.feedforward()[3 + i]);
    }

    fn add_joints(&mut self, env: &Env, step: &Step) {
        let (rate, interval) = (f64::from(env.config().controller.policy_hz), &step.interval);
        let torque = interval.mean_torque();
        self.put_joints(env, "Joint torque", "Nm", |i| torque[i]);
        self.put_joints(env, "Joint power", "W", |i| interval.joint_work[i] * rate);
        self.put("Joint power", "W", "sum of |tau qd|", interval.energy.absolute * rate);
    }

    fn add_reward(&mut self, env: &Env, step: &Step) {
        for (term, value) in step.reward_terms.iter() {
            self.put("Reward", "per action", term, value);
        }
        if env.config().motion_price > 0.0 {
            self.put("Reward", "per action", "price of motion", -step.motion_cost);
        }
        if env.config().stop_price.is_some() {
            self.put("Reward", "per action", "price of a stop", -step.stop_cost);
        }
        // Last, so that it is drawn over a term that equals it.
        self.put("Reward", "per action", "sum", step.reward);
    }
}

/// Control samples of an action.
fn samples(step: &Step) -> f64 {
    f64::from(step.interval.samples.max(1))
}
