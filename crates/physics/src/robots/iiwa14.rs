//! KUKA LBR iiwa 14 R820.
//!
//! Frames, masses, inertias and ranges are those of the model in MuJoCo Menagerie (`kuka_iiwa_14`, commit 28ffb48; BSD-3-Clause), which is
//! made of Drake's URDF of the arm. Largest torques and speeds are those of KUKA's data sheet for the LBR iiwa 14 R820.
//! Neither source gives rotor inertia, damping or friction: they are the FR3's here, and so are the drives. Low damping and
//! friction fit this arm too, because its joint torque sensors compensate most of the gears' friction. The capsules
//! were drawn around the spheres by which Menagerie's model collides.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use aforce::Arm;

use super::link_data::Turn::Quaternion;
use super::link_data::{LinkData, NEIGHBOURS};
use super::panda::capsule;
use super::{JOINTS, Mount, Robot, fr3};
use crate::scene::{Role, pose};

/// Half of the square root of two, for turns by a quarter.
const Q: f64 = FRAC_1_SQRT_2;

const LINKS: [LinkData; JOINTS] = [
    LinkData {
        position: [0.0, 0.0, 0.1575],
        turn: Quaternion([1.0, 0.0, 0.0, 0.0]),
        mass: 5.76,
        com: [0.0, -0.03, 0.12],
        moments: [0.0333, 0.033, 0.0123],
        capsules: &[([0.0, 0.0, 0.0], [0.0, -0.03, 0.06], 0.08), ([0.0, -0.03, 0.06], [0.0, -0.045, 0.11], 0.075)],
    },
    LinkData {
        position: [0.0, 0.0, 0.2025],
        turn: Quaternion([0.0, 0.0, Q, Q]),
        mass: 6.35,
        com: [0.0003, 0.059, 0.042],
        moments: [0.0305, 0.0304, 0.011],
        capsules: &[([0.0, 0.0, -0.01], [0.0, 0.0, 0.045], 0.09), ([0.0, 0.04, 0.054], [0.0, 0.18, 0.0], 0.075)],
    },
    LinkData {
        position: [0.0, 0.2045, 0.0],
        turn: Quaternion([0.0, 0.0, Q, Q]),
        mass: 3.5,
        com: [0.0, 0.03, 0.13],
        moments: [0.025, 0.0238, 0.0076],
        capsules: &[([0.0, 0.0, 0.0355], [0.0, 0.05, 0.15], 0.07), ([0.0, 0.045, 0.2155], [0.0, 0.0, 0.2155], 0.075)],
    },
    LinkData {
        position: [0.0, 0.0, 0.2155],
        turn: Quaternion([Q, Q, 0.0, 0.0]),
        mass: 3.5,
        com: [0.0, 0.067, 0.034],
        moments: [0.017, 0.0164, 0.006],
        capsules: &[([0.0, 0.01, 0.046], [0.0, 0.06, 0.05], 0.075), ([0.0, 0.06, 0.05], [0.0, 0.184, 0.0], 0.072)],
    },
    LinkData {
        position: [0.0, 0.1845, 0.0],
        turn: Quaternion([0.0, 0.0, Q, Q]),
        mass: 3.5,
        com: [0.0001, 0.021, 0.076],
        moments: [0.01, 0.0087, 0.00449],
        capsules: &[([0.0, 0.0, 0.0335], [0.0, 0.04, 0.09], 0.07), ([0.0, 0.06, 0.1], [0.0, 0.065, 0.1855], 0.045)],
    },
    LinkData {
        position: [0.0, 0.0, 0.2155],
        turn: Quaternion([Q, Q, 0.0, 0.0]),
        mass: 1.8,
        com: [0.0, 0.0006, 0.0004],
        moments: [0.0049, 0.0047, 0.0036],
        capsules: &[([0.0, 0.0, -0.059], [0.0, -0.01, 0.0], 0.065), ([0.0, -0.03, 0.011], [0.0, 0.0, 0.0], 0.075)],
    },
    LinkData {
        position: [0.0, 0.081, 0.0],
        turn: Quaternion([0.0, 0.0, Q, Q]),
        mass: 1.2,
        com: [0.0, 0.0, 0.02],
        moments: [0.001, 0.001, 0.001],
        capsules: &[([-0.02, 0.0, 0.0], [0.02, 0.0, 0.0], 0.045)],
    },
];

/// An iiwa 14 with Franka's hand.
pub fn iiwa14() -> Robot {
    let degrees = PI / 180.0;
    let other = fr3::fr3();
    Robot {
        name: "iiwa14".into(),
        arm: Arm {
            range: [2.96706, 2.0944, 2.96706, 2.0944, 2.96706, 2.0944, 3.05433].map(|end: f64| [-end, end]),
            speed_max: [85.0, 85.0, 100.0, 75.0, 130.0, 135.0, 135.0].map(|speed: f64| speed * degrees),
            torque_max: [320.0, 320.0, 176.0, 176.0, 110.0, 40.0, 40.0],
            // KUKA gives no limits for the tool; these are a Panda's.
            cartesian: Arm::PANDA.cartesian,
            ..Arm::FR3
        },
        base: vec![capsule("link0", 0, Role::Fixture, [-0.07, 0.0, 0.08], [0.0, 0.0, 0.05], 0.08)],
        links: std::array::from_fn(|i| LINKS[i].link(i, &other.links[i])),
        // Menagerie's `attachment_site`. The hand is mounted with half a turn, which keeps joint 7 away from its ends.
        flange: pose([0.0, 0.0, 0.045], [0.0, 0.0, 0.0, 1.0]),
        home: HOME.into(),
        // Lower and farther away than the Panda's: the links are longer, and the elbow would be bent to its end.
        mount: Mount::column(0.72, 0.2),
        never_touch: NEIGHBOURS.into(),
        ..other
    }
}

/// The flange where the Panda's is, the elbow up.
const HOME: [f64; JOINTS] = [0.0, 0.36318, 0.0, -1.852_25, 0.0, 0.79891, -0.000_48];
