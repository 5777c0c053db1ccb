//! The robot's part of an observation, named and ordered as in robosuite.

use aforce::Measurement;
use nalgebra::UnitQuaternion;
use physics::Simulation;
use physics::robots::tool_rotation;

use crate::component::{Component, xyz, xyzw};

/// Largest magnitude of a scaled component.
pub const CLIP: f32 = 10.0;
/// Force that counts as contact (N).
const CONTACT_FORCE: f64 = 1.0;

/// Names, units and scales of the robot's part: 32 numbers with fingers; 29 with the wiping tool,
/// whose contact flag stands where the fingers' joints would.
pub fn proprioception_components(has_fingers: bool) -> Vec<Component> {
    let joints =
        |name: &str, unit| (1..=7).map(|i| Component::new(format!("{name}_{i}"), unit, 0.0, 1.0)).collect::<Vec<_>>();
    let mut components = [joints("joint_cos", "1"), joints("joint_sin", "1"), joints("joint_vel", "rad/s")].concat();
    components.extend(xyz("eef_pos", [-0.05, 0.0, 0.9], 5.0));
    components.extend(xyzw("eef_quat"));
    if has_fingers {
        components.push(Component::new("gripper_qpos_left", "m", 0.02, 50.0));
        components.push(Component::new("gripper_qpos_right", "m", -0.02, 50.0));
        components.push(Component::new("gripper_qvel_left", "m/s", 0.0, 10.0));
        components.push(Component::new("gripper_qvel_right", "m/s", 0.0, 10.0));
    } else {
        components.push(Component::new("gripper_contact", "0 or 1", 0.0, 1.0));
    }
    components
}

/// Whether the tool feels contact.
pub fn in_contact(y: &Measurement) -> bool {
    y.wrench.fixed_rows::<3>(0).norm() > CONTACT_FORCE
}

/// Appends the robot's part of an observation. The position is the grip site's, the
/// quaternion (x, y, z, w) that of the body `right_hand`, as in robosuite; its sign is
/// fixed here (x not negative), there it is left to chance.
pub fn observe_robot(simulation: &Simulation, y: &Measurement, out: &mut Vec<f32>) {
    out.extend(y.q.iter().map(|&q| libm::cos(q) as f32));
    out.extend(y.q.iter().map(|&q| libm::sin(q) as f32));
    out.extend(y.qd.iter().map(|&qd| qd as f32));
    out.extend(y.pose.translation.vector.iter().map(|&p| p as f32));
    let hand: UnitQuaternion<f64> = y.pose.rotation * tool_rotation().inverse();
    let sign = if hand.i < 0.0 { -1.0 } else { 1.0 };
    out.extend(hand.coords.iter().map(|&c| (sign * c) as f32));
    match simulation.fingers() {
        Some([left, right]) => out.extend([left.0 as f32, right.0 as f32, left.1 as f32, right.1 as f32]),
        None => out.push(f32::from(u8::from(in_contact(y)))),
    }
}

/// Scales an observation in place: every component about 1, and never beyond 10.
pub fn scale(components: &[Component], observation: &mut [f32]) {
    for (value, component) in observation.iter_mut().zip(components) {
        *value = ((*value - component.centre) * component.scale).clamp(-CLIP, CLIP);
    }
}
