//! Checks that the parts of an arm's state agree with each other: the Jacobian with the motion of the pose, the mass matrix with its
//! transpose, gravity with the torque that holds the arm.
//!
//! A wrong frame, order of rows, sign, unit or triangle, or a field that was not filled, gives plausible numbers. Such a mistake shows only
//! where two parts of the state must agree. The cost of the comparisons is linear in the number of entries, apart from one factorisation of
//! M.

use crate::arm::Arm;
use crate::host::interface::{ArmState, CompensatedBy};
use crate::host::status::Fault;
use crate::law::gains::AXES;
use crate::spatial::{
    Jacobian, JointMatrix, JointVector, Measurement, Pose, Vector6, asymmetry, linear, rotational, stack,
};

/// Least inertia of a joint while the joints before it are free and those after it are held (kg m^2). The last links of an arm have about
/// 1e-3.
const INERTIA: f64 = 1e-5;
/// Largest difference of the length of a joint's axis from 1.
const AXIS: f64 = 1e-2;
/// A Coriolis torque (Nm) stays below CORIOLIS trace(M) |qd|^2 plus `CORIOLIS_REST` times the joint's largest torque.
const CORIOLIS: f64 = 4.0;
/// Share of the joint's largest torque in the bound on Coriolis torques.
const CORIOLIS_REST: f64 = 0.02;
/// Largest torque of a resting arm that gravity and wrench do not explain, as a share of the joint's largest torque.
/// Friction or a payload may cause one.
const REST: f64 = 0.2;
/// An arm is at rest if no joint is faster than this (rad/s).
const RESTING: f64 = 0.05;
/// Time constants over which motion is added up (s): a short one for a sudden disagreement, a long one for a slow one.
const WINDOWS: [f64; 2] = [0.02, 0.2];
/// Difference between measured motion and integrated speed that is always allowed: of a joint (rad), of the tool (m, rad).
const JOINT_MOTION: f64 = 1e-3;
const TOOL_MOTION: [f64; 2] = [2e-4, 1e-3];
/// Difference that is allowed in addition, as a share of the distance moved.
const MOTION_SHARE: f64 = 0.25;
/// Allowed change of an entry of the Jacobian while no joint moves (m/rad; 1 in the rotational rows).
const JACOBIAN_JUMP: f64 = 0.02;
/// Allowed change of a gravity torque while no joint moves, as a share of the arm's largest torque. It lets a host add a load of 3 kg to
/// its model while the arm holds the load.
const GRAVITY_JUMP: f64 = 0.3;
/// Time after a start from which on the arm's motion is compared with gravity, and the time at which the comparison ends (s).
const TRIAL: [f64; 2] = [0.005, 0.1];
/// Allowed difference between the gravity torque that the motion shows and the one that the state reports, as a share of the norm of the
/// reported one, but at least `GRAVITY_FLOOR` (Nm).
const GRAVITY_SHARE: f64 = 0.6;
const GRAVITY_FLOOR: f64 = 8.0;

/// The comparisons and their state.
#[derive(Debug, Clone)]
pub(crate) struct Agreement {
    /// Factor on the tolerances; infinite: nothing is compared.
    scale: f64,
    torque_max: JointVector,
    gravity_by: CompensatedBy,
    windows: [Window; 2],
    last: Option<Last>,
    trial: Option<Trial>,
}

/// The last state, as far as it is compared.
#[derive(Debug, Clone)]
struct Last {
    y: Motion,
    jacobian: Jacobian,
    gravity: JointVector,
}

#[derive(Debug, Clone, Copy)]
struct Motion {
    q: JointVector,
    qd: JointVector,
    pose: Pose,
    twist: Vector6,
}

/// Measured motion (`moved`), and speed times time (`told`), each summed up with exponential forgetting over `time` (s). `way` sums up the
/// larger absolute value of the two.
#[derive(Debug, Clone, Copy)]
struct Window {
    time: f64,
    /// Of the joints (rad).
    moved: JointVector,
    told: JointVector,
    way: JointVector,
    /// Of the tool (m, rad).
    tool_moved: Vector6,
    tool_told: Vector6,
    tool_way: [f64; 2],
}

/// The check of gravity after a start at rest: time since the start (s), the arm's momentum at the start, and the impulse of the reported
/// torques since (Nm s).
#[derive(Debug, Clone)]
struct Trial {
    time: f64,
    momentum: JointVector,
    impulse: JointVector,
}

impl Window {
    fn new(time: f64) -> Self {
        let (joints, tool) = (JointVector::zeros(), Vector6::zeros());
        Self { time, moved: joints, told: joints, way: joints, tool_moved: tool, tool_told: tool, tool_way: [0.0; 2] }
    }

    /// Adds one cycle of `dt` seconds. Each pair is the measured motion, and speed times time.
    fn add(&mut self, moved: [&JointVector; 2], tool: [&Vector6; 2], dt: f64) {
        let kept = 1.0 / (1.0 + dt / self.time);
        let ([moved, told], [tool_moved, tool_told]) = (moved, tool);
        self.moved = kept * (self.moved + moved);
        self.told = kept * (self.told + told);
        self.way = kept * (self.way + moved.abs().sup(&told.abs()));
        self.tool_moved = kept * (self.tool_moved + tool_moved);
        self.tool_told = kept * (self.tool_told + tool_told);
        for (way, part) in self.tool_way.iter_mut().zip([linear, rotational]) {
            *way = kept * (*way + part(tool_moved).norm().max(part(tool_told).norm()));
        }
    }

    fn check(&self, scale: f64) -> Result<(), Fault> {
        let time = self.time;
        for joint in 0..7 {
            let (moved, told) = (self.moved[joint], self.told[joint]);
            if (moved - told).abs() > scale * (JOINT_MOTION + MOTION_SHARE * self.way[joint]) {
                return Err(Fault::JointMotion { joint: joint + 1, moved, told, time });
            }
        }
        for (axis, name) in AXES.into_iter().enumerate() {
            let (moved, told, part) = (self.tool_moved[axis], self.tool_told[axis], axis / 3);
            if (moved - told).abs() > scale * (TOOL_MOTION[part] + MOTION_SHARE * self.tool_way[part]) {
                return Err(Fault::ToolMotion { axis: name, moved, told, time });
            }
        }
        Ok(())
    }
}

impl Agreement {
    pub(crate) fn new(scale: f64, arm: &Arm, gravity_by: CompensatedBy) -> Self {
        let windows = WINDOWS.map(Window::new);
        Self { scale, torque_max: arm.torque_max.into(), gravity_by, windows, last: None, trial: None }
    }

    /// Checks before a start: the state by itself and, if the arm is at rest, its torque against gravity and wrench.
    pub(crate) fn at_start(&self, state: &ArmState, y: &Measurement) -> Result<(), Fault> {
        if self.scale.is_infinite() {
            return Ok(());
        }
        self.by_itself(state)?;
        if state.qd.amax() > RESTING {
            return Ok(());
        }
        let gravity = match self.gravity_by {
            CompensatedBy::Law => state.gravity,
            CompensatedBy::Arm => JointVector::zeros(),
        };
        let expected = gravity - y.jacobian.tr_mul(&y.wrench);
        for joint in 0..7 {
            let (found, expected) = (state.tau[joint], expected[joint]);
            let max = self.scale * REST * self.torque_max[joint];
            if (found - expected).abs() > max {
                return Err(Fault::RestTorque { joint: joint + 1, found, expected, max });
            }
        }
        Ok(())
    }

    /// Starts the comparisons with this state.
    pub(crate) fn reset(&mut self, state: &ArmState, y: &Measurement) {
        self.windows = WINDOWS.map(Window::new);
        self.last = Some(Last::of(state, y));
        let rests = state.qd.amax() <= RESTING;
        self.trial = rests.then(|| Trial { time: 0.0, momentum: y.mass * y.qd, impulse: JointVector::zeros() });
    }

    /// Checks a state while the law acts, `dt` seconds after the last. With a `dt` of 0 the two are not compared.
    pub(crate) fn check(&mut self, state: &ArmState, y: &Measurement, dt: f64) -> Result<(), Fault> {
        if self.scale.is_infinite() {
            return Ok(());
        }
        self.by_itself(state)?;
        let now = Last::of(state, y);
        if let Some(last) = self.last.replace(now)
            && dt > 0.0
        {
            self.jumps(&last, state)?;
            self.motion(&last.y, y, dt)?;
            self.gravity(state, y, dt)?;
        }
        Ok(())
    }

    /// The checks that need one state only.
    fn by_itself(&self, state: &ArmState) -> Result<(), Fault> {
        let mass = &state.mass;
        if let Some([row, column]) = asymmetry(mass) {
            let (lower, upper) = (mass[(row, column)], mass[(column, row)]);
            return Err(Fault::MassAsymmetric { row: row + 1, column: column + 1, lower, upper });
        }
        if let Some((joint, inertia)) = lightest(mass) {
            return Err(Fault::MassFloor { joint: joint + 1, inertia, min: INERTIA });
        }
        for (joint, column) in state.jacobian.column_iter().enumerate() {
            // A six-joint arm is given a seventh joint that moves nothing: its column of the Jacobian is zero, and it shares no inertia
            // with another joint.
            let shares = (0..7).any(|other| other != joint && mass[(joint, other)] != 0.0);
            if !shares && column.iter().all(|entry| *entry == 0.0) {
                continue;
            }
            let length = column.fixed_rows::<3>(3).norm();
            if (length - 1.0).abs() > self.scale * AXIS {
                return Err(Fault::JacobianAxis { joint: joint + 1, length });
            }
        }
        let fastest = CORIOLIS * mass.trace() * state.qd.norm_squared();
        for joint in 0..7 {
            let torque = state.coriolis[joint];
            let max = self.scale * (fastest + CORIOLIS_REST * self.torque_max[joint]);
            if torque.abs() > max {
                return Err(Fault::Coriolis { joint: joint + 1, torque, max });
            }
        }
        Ok(())
    }

    /// Jacobian and gravity depend on the joint angles alone, so they change no faster than the angles allow.
    fn jumps(&self, last: &Last, state: &ArmState) -> Result<(), Fault> {
        let way: f64 = (state.q - last.y.q).iter().map(|moved| moved.abs()).sum();
        // A column turns with the joints before and after it: no entry changes by more than the longest column's length per radian.
        let longest = state.jacobian.amax().max(1.0) * 2.0;
        let (change, max) =
            ((state.jacobian - last.jacobian).amax(), self.scale * (JACOBIAN_JUMP + 2.0 * longest * way));
        if change > max {
            return Err(Fault::Jump { field: "jacobian", change, max });
        }
        if self.gravity_by == CompensatedBy::Law {
            let (change, strongest) = ((state.gravity - last.gravity).amax(), self.torque_max.max());
            let max = self.scale * strongest * (GRAVITY_JUMP + 2.0 * way);
            if change > max {
                return Err(Fault::Jump { field: "gravity", change, max });
            }
        }
        Ok(())
    }

    /// Compares the motion of joints and tool with their speeds.
    fn motion(&mut self, last: &Motion, y: &Measurement, dt: f64) -> Result<(), Fault> {
        let (moved, told) = (y.q - last.q, 0.5 * dt * (y.qd + last.qd));
        let tool_moved = difference(&y.pose, &last.pose);
        let tool_told = 0.5 * dt * (y.twist + last.twist);
        for window in &mut self.windows {
            window.add([&moved, &told], [&tool_moved, &tool_told], dt);
            window.check(self.scale)?;
        }
        Ok(())
    }

    /// For a short time after a start at rest: the arm's momentum should grow by the impulse of the torques in the state. A difference
    /// along gravity means that gravity has another sign, or is compensated twice or not at all.
    fn gravity(&mut self, state: &ArmState, y: &Measurement, dt: f64) -> Result<(), Fault> {
        let Some(trial) = &mut self.trial else { return Ok(()) };
        trial.time += dt;
        trial.impulse += dt * (state.tau - y.bias + y.jacobian.tr_mul(&y.wrench));
        let [least, most] = TRIAL;
        if trial.time > most {
            self.trial = None;
            return Ok(());
        }
        let weight = state.gravity.norm();
        if trial.time < least || weight == 0.0 {
            return Ok(());
        }
        // M is taken as constant: a resting arm hardly moves in this time.
        let unexplained = (y.mass * y.qd - trial.momentum - trial.impulse) / trial.time;
        let along = unexplained.dot(&state.gravity) / weight;
        if along.abs() > self.scale * GRAVITY_FLOOR.max(GRAVITY_SHARE * weight) {
            let told = match self.gravity_by {
                CompensatedBy::Law => weight,
                CompensatedBy::Arm => 0.0,
            };
            return Err(Fault::Gravity { found: told - along, told });
        }
        Ok(())
    }
}

impl Last {
    fn of(state: &ArmState, y: &Measurement) -> Self {
        let motion = Motion { q: y.q, qd: y.qd, pose: y.pose, twist: y.twist };
        Self { y: motion, jacobian: state.jacobian, gravity: state.gravity }
    }
}

/// The first joint whose pivot in M = L D L^T is below [`INERTIA`], with that pivot: its inertia while those before it are free.
fn lightest(mass: &JointMatrix) -> Option<(usize, f64)> {
    let mut l = JointMatrix::zeros();
    let mut pivots = JointVector::zeros();
    for j in 0..7 {
        let mut pivot = mass[(j, j)];
        for k in 0..j {
            pivot -= l[(j, k)] * l[(j, k)] * pivots[k];
        }
        if pivot < INERTIA {
            return Some((j, pivot));
        }
        pivots[j] = pivot;
        for i in j + 1..7 {
            let mut entry = mass[(i, j)];
            for k in 0..j {
                entry -= l[(i, k)] * l[(j, k)] * pivots[k];
            }
            l[(i, j)] = entry / pivot;
        }
    }
    None
}

/// The motion from one pose to the next (m, rad; base axes). A turn counts as its axis times 2 sin(angle/2): that is
/// the angle while it is small, and it grows with the angle up to half a turn.
fn difference(to: &Pose, from: &Pose) -> Vector6 {
    let turn = to.rotation * from.rotation.inverse();
    let sign = if turn.w < 0.0 { -2.0 } else { 2.0 };
    stack(&(to.translation.vector - from.translation.vector), &(sign * turn.imag()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::gantry;
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    /// A quaternion and its negative are one rotation, and an arm's pose may come back as either.
    #[test]
    fn a_quaternion_that_changes_its_sign_is_no_turn() {
        let small = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, 1e-3));
        let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -2.0, 1.0));
        let [from, to] = [rotation, small * rotation].map(|turn| Pose::from_parts(Translation3::identity(), turn));
        let negated = UnitQuaternion::new_unchecked(-to.rotation.into_inner());
        let other = Pose::from_parts(to.translation, negated);
        assert!((difference(&other, &from) - difference(&to, &from)).norm() < 1e-15);
        assert!((difference(&other, &from)[5] - 1e-3).abs() < 1e-9);
    }

    /// The seventh joint of a six-joint arm moves nothing. A column that was not filled differs from that of such a joint by the inertia
    /// that the joint shares with others.
    #[test]
    fn a_joint_that_moves_nothing_has_no_axis() {
        let mut y = gantry([1.0; 6]);
        y.jacobian = Jacobian::from_fn(|row, joint| if joint < 6 && row == 5 { 1.0 } else { 0.0 });
        y.mass = JointMatrix::identity();
        let agreement = Agreement::new(1.0, &Arm::PANDA, CompensatedBy::Law);
        let start = |mass: JointMatrix| {
            let (zeros, pose, jacobian) = (JointVector::zeros(), y.pose, y.jacobian);
            let (wrench, q, qd) = (Vector6::zeros(), y.q, zeros);
            let (gravity, coriolis, tau) = (zeros, zeros, zeros);
            agreement.by_itself(&ArmState { q, qd, pose, jacobian, mass, gravity, coriolis, wrench, tau })
        };
        assert_eq!(start(y.mass), Ok(()));
        (y.mass[(6, 0)], y.mass[(0, 6)]) = (0.1, 0.1);
        assert!(matches!(start(y.mass), Err(Fault::JacobianAxis { joint: 7, .. })));
    }

    /// The torque of a moving arm is not gravity's alone, so at a start in motion it is not compared with gravity.
    #[test]
    fn only_at_rest_the_torque_is_held_against_gravity() {
        let mut y = gantry([1.0; 6]);
        // Seven hinges about z.
        y.jacobian.row_mut(3).fill(0.0);
        y.jacobian.row_mut(4).fill(0.0);
        y.jacobian.row_mut(5).fill(1.0);
        let agreement = Agreement::new(1.0, &Arm::PANDA, CompensatedBy::Law);
        let with = |speed: f64, gravity: f64| {
            let mut qd = JointVector::zeros();
            qd[1] = speed;
            let state = ArmState {
                q: y.q,
                qd,
                pose: y.pose,
                jacobian: y.jacobian,
                mass: y.mass,
                gravity: JointVector::repeat(gravity),
                coriolis: JointVector::zeros(),
                wrench: y.wrench,
                tau: JointVector::zeros(),
            };
            agreement.at_start(&state, &y)
        };
        assert_eq!(with(0.0, 0.0), Ok(()));
        assert!(matches!(with(0.0, 80.0), Err(Fault::RestTorque { joint: 1, .. })), "{:?}", with(0.0, 80.0));
        assert_eq!(with(2.0 * RESTING, 80.0), Ok(()));
    }
}
