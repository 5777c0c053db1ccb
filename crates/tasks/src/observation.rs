//! The robot's part of an observation, named and ordered as in robosuite.

use aforce::{JointVector, Measurement};
use nalgebra::UnitQuaternion;
use physics::Simulation;
use physics::robots::tool_rotation;

use crate::observer::{Component, Observer};

/// Largest magnitude of a scaled component.
pub const CLIP: f32 = 10.0;
/// Force that counts as contact (N).
const CONTACT_FORCE: f64 = 1.0;

/// Whether the measured force on the tool is above 1 N.
pub fn in_contact(y: &Measurement) -> bool {
    y.wrench.fixed_rows::<3>(0).norm() > CONTACT_FORCE
}

/// Puts the robot's part of an observation: 32 numbers with fingers; 29 with the wiping tool, which has a contact flag in
/// place of the fingers' joints. The position is the grip site's, the quaternion (x, y, z, w) that of the body
/// `right_hand`, as in robosuite. The quaternion's sign makes x not negative; robosuite does not fix it.
pub fn observe_robot(simulation: &Simulation, y: &Measurement, out: &mut Observer) {
    let mut joints = |name: &str, values: JointVector, unit| {
        for (i, &value) in values.iter().enumerate() {
            out.put(format_args!("{name}_{}", i + 1), value, unit, 0.0, 1.0);
        }
    };
    joints("joint_cos", y.q.map(libm::cos), "1");
    joints("joint_sin", y.q.map(libm::sin), "1");
    joints("joint_vel", y.qd, "rad/s");
    out.position("eef_pos", y.pose.translation.vector, [-0.05, 0.0, 0.9], 5.0);
    let hand: UnitQuaternion<f64> = y.pose.rotation * tool_rotation().inverse();
    out.orientation("eef_quat", &if hand.i < 0.0 { UnitQuaternion::new_unchecked(-*hand) } else { hand });
    match simulation.fingers() {
        Some([left, right]) => {
            out.put("gripper_qpos_left", left.0, "m", 0.02, 50.0);
            out.put("gripper_qpos_right", right.0, "m", -0.02, 50.0);
            out.put("gripper_qvel_left", left.1, "m/s", 0.0, 10.0);
            out.put("gripper_qvel_right", right.1, "m/s", 0.0, 10.0);
        }
        None => out.put("gripper_contact", f64::from(in_contact(y)), "0 or 1", 0.0, 1.0),
    }
}

/// Scales an observation in place: each value becomes (value - centre) * scale, clipped to -10 to 10.
pub fn scale(components: &[Component], observation: &mut [f32]) {
    for (value, component) in observation.iter_mut().zip(components) {
        *value = ((*value - component.centre) * component.scale).clamp(-CLIP, CLIP);
    }
}
