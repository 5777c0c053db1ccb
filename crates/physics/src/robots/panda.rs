//! The Franka Emika Panda, in two sets of numbers.

use aforce::Arm;
use nalgebra::{Matrix3, Vector3};

use super::{GripperInertials, JOINTS, Link, Mount, Robot};
use crate::scene::{Air, Geom, Inertial, Role, Shape, at, between, pose};

/// Joint angles at the start of an episode before noise (rad), as robosuite's.
pub const HOME: [f64; JOINTS] = [
    0.0,
    std::f64::consts::PI / 16.0,
    0.0,
    -5.0 * std::f64::consts::PI / 6.0,
    0.0,
    std::f64::consts::PI - 0.2,
    std::f64::consts::PI / 4.0,
];

/// Frame of each link in its parent: position (m) and quaternion (w, x, y, z).
const LINK_FRAMES: [([f64; 3], [f64; 4]); JOINTS] = {
    const Q: f64 = std::f64::consts::FRAC_1_SQRT_2;
    [
        ([0.0, 0.0, 0.333], [1.0, 0.0, 0.0, 0.0]),
        ([0.0, 0.0, 0.0], [Q, -Q, 0.0, 0.0]),
        ([0.0, -0.316, 0.0], [Q, Q, 0.0, 0.0]),
        ([0.0825, 0.0, 0.0], [Q, Q, 0.0, 0.0]),
        ([-0.0825, 0.384, 0.0], [Q, -Q, 0.0, 0.0]),
        ([0.0, 0.0, 0.0], [Q, Q, 0.0, 0.0]),
        ([0.088, 0.0, 0.0], [Q, Q, 0.0, 0.0]),
    ]
};

/// Pairs of parts that never touch: 0 is every fixture, 1 to 7 a link, 7 also the hand. Links 1 and 2 may touch what lies
/// beyond the elbow, and link 5 the hand, so these pairs are not in the list. In 3000 random postures robosuite's meshes,
/// of which all but neighbours may collide, overlap in no other pair. Links 1 and 2 cannot reach a fixture.
const NEVER_TOUCH: [[u8; 2]; 16] = [
    [0, 1],
    [0, 2],
    [1, 2],
    [1, 3],
    [1, 4],
    [2, 3],
    [2, 4],
    [3, 4],
    [3, 5],
    [3, 6],
    [3, 7],
    [4, 5],
    [4, 6],
    [4, 7],
    [5, 6],
    [6, 7],
];

/// The round numbers of robosuite's Panda, with its rotor inertia of 5/(i+1) kg m2 and its air, which takes 6 to 9 Nm from a
/// joint at 1 rad/s: results are comparable with what is published for its tasks.
pub fn robosuite() -> Robot {
    let link = |mass, com, i: f64| Inertial::diagonal(mass, com, [i; 3]);
    let inertials = [
        link(3.0, [0.0, 0.0, -0.07], 0.3),
        link(3.0, [0.0, -0.1, 0.0], 0.3),
        link(2.0, [0.04, 0.0, -0.05], 0.2),
        link(2.0, [-0.04, 0.05, 0.0], 0.2),
        link(2.0, [0.0, 0.0, -0.15], 0.2),
        link(1.5, [0.06, 0.0, 0.0], 0.1),
        link(0.5, [0.0, 0.0, 0.08], 0.05),
    ];
    Robot {
        name: "robosuite".into(),
        joints: JOINTS,
        arm: Arm {
            torque_max: [80.0, 80.0, 80.0, 80.0, 80.0, 12.0, 12.0],
            torque_rate_max: [f64::INFINITY; JOINTS],
            rotor_inertia: std::array::from_fn(|i| 5.0 / (i as f64 + 1.0)),
            ..Arm::PANDA
        },
        base: vec![capsule("link0", 0, Role::Fixture, [-0.0573, 0.0, 0.0628], [-0.0003, 0.0, 0.0517], 0.075)],
        links: links(inertials, [0.1, 0.1, 0.1, 0.1, 0.1, 0.01, 0.01], [0.1; JOINTS]),
        flange: pose([0.0, 0.0, 0.1065], [0.924, 0.0, 0.0, -0.383]),
        flange_inertial: link(0.5, [0.0; 3], 0.05),
        gripper: GripperInertials {
            // Principal moments 0.09, 0.07, 0.05 in axes turned by +90 degrees about x.
            palm: Inertial::diagonal(0.3, [0.0, 0.0, 0.17], [0.09, 0.05, 0.07]),
            finger: Inertial::diagonal(0.1, [0.0, 0.0, 0.05], [0.01, 0.01, 0.005]),
            tip: Inertial::diagonal(0.01, [0.0; 3], [0.01; 3]),
        },
        home: HOME.into(),
        // Joint 5 has the small drive of the real arm, of 12 Nm. As robosuite's joint 5 may give 80 Nm, its copper
        // losses come out too large.
        drives: Arm::FRANKA_DRIVES,
        mount: Mount { height: 0.912, behind_table: 0.16, geoms: pedestal() },
        never_touch: NEVER_TOUCH.into(),
        air: Some(Air { density: 1.2, viscosity: 2e-5 }),
    }
}

/// Parameters identified on a real arm (Gaz et al., RA-L 2019, as carried by franka_description), with the rotor inertia and
/// torque limits of the maker. Values that are not given here are robosuite's.
pub fn identified() -> Robot {
    let inertials = [
        inertial(4.970684, [0.003875, 0.002081, -0.04762], [0.70337, 0.70661, 0.009117, -0.000139, 0.006772, 0.019169]),
        inertial(
            0.646926,
            [-0.003141, -0.02872, 0.003495],
            [0.007962, 0.02811, 0.025995, -0.003925, 0.010254, 0.000704],
        ),
        inertial(
            3.228604,
            [0.027518, 0.039252, -0.066502],
            [0.037242, 0.036155, 0.01083, -0.004761, -0.011396, -0.012805],
        ),
        inertial(
            3.587895,
            [-0.05317, 0.104419, 0.027454],
            [0.025853, 0.019552, 0.028323, 0.007796, -0.001332, 0.008641],
        ),
        inertial(
            1.225946,
            [-0.011953, 0.041065, -0.038437],
            [0.035549, 0.029474, 0.008627, -0.002117, -0.004037, 0.000229],
        ),
        inertial(
            1.666555,
            [0.060149, -0.014117, -0.010517],
            [0.001964, 0.004354, 0.005433, 0.000109, -0.001158, 0.000341],
        ),
        inertial(
            0.735522,
            [0.010517, -0.004252, 0.061597],
            [0.012516, 0.010027, 0.004815, -0.000428, -0.001196, -0.000741],
        ),
    ];
    Robot {
        name: "identified".into(),
        arm: Arm::PANDA,
        links: links(inertials, [1.0; JOINTS], [0.0; JOINTS]),
        flange_inertial: Inertial::diagonal(0.73, [-0.01, 0.0, 0.03], [0.001, 0.0025, 0.0017]),
        gripper: GripperInertials {
            palm: Inertial::NONE, // The maker's hand above includes it.
            finger: Inertial::diagonal(0.015, [0.0; 3], [2.375e-6, 2.375e-6, 7.5e-7]),
            tip: Inertial::NONE, // The maker's finger above includes it.
        },
        air: None,
        ..robosuite()
    }
}

/// From mass (kg), centre of mass (m), and inertia about it as xx, yy, zz, xy, xz, yz (kg m2).
pub(super) fn inertial(mass: f64, com: [f64; 3], [xx, yy, zz, xy, xz, yz]: [f64; 6]) -> Inertial {
    Inertial { mass, com: com.into(), inertia: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) }
}

/// Links with the frames and the shapes of a Panda's, and with these masses, damping (Nm s/rad) and dry friction (Nm).
pub(super) fn links(inertials: [Inertial; JOINTS], damping: [f64; JOINTS], friction: [f64; JOINTS]) -> [Link; JOINTS] {
    std::array::from_fn(|i| {
        let (position, wxyz) = LINK_FRAMES[i];
        Link {
            frame: pose(position, wxyz),
            inertial: inertials[i],
            geoms: link_geoms(i + 1),
            damping: damping[i],
            friction: friction[i],
        }
    })
}

/// Two capsules per link, least-squares fits to the convex hulls of the maker's meshes
/// (outside and inside by about 1 cm).
fn link_geoms(link: usize) -> Vec<Geom> {
    type Capsule = ([f64; 3], [f64; 3], f64);
    const FITS: [[Capsule; 2]; JOINTS] = [
        [
            ([0.0003, 0.0017, -0.1527], [0.0, -0.0348, 0.0006], 0.0572),
            ([0.0002, -0.0760, -0.0006], [-0.0003, -0.0153, -0.1497], 0.0543),
        ],
        [
            ([-0.0011, -0.1538, -0.0026], [0.0, 0.0008, 0.0369], 0.0570),
            ([0.0, -0.0007, 0.0758], [0.0008, -0.1539, 0.0142], 0.0540),
        ],
        [
            ([-0.0030, -0.0013, -0.0782], [0.0832, 0.0333, 0.0024], 0.0561),
            ([0.0805, 0.0533, -0.0020], [0.0192, 0.0100, -0.0739], 0.0585),
        ],
        [
            ([0.0019, -0.0015, 0.0318], [-0.0012, 0.0012, 0.0591], 0.0547),
            ([-0.0766, 0.0789, 0.0034], [-0.0248, 0.0248, 0.0321], 0.0623),
        ],
        [
            ([-0.0010, 0.0070, -0.2205], [0.0005, 0.0551, -0.0550], 0.0604),
            ([-0.0003, 0.0799, -0.0023], [-0.0023, 0.0496, -0.0050], 0.0538),
        ],
        [
            ([0.0911, -0.0159, -0.0003], [-0.0021, -0.0046, 0.0141], 0.0456),
            ([-0.0002, 0.0061, 0.0143], [0.0846, 0.0412, 0.0006], 0.0446),
        ],
        [
            ([-0.0234, -0.0095, 0.0775], [0.0062, 0.0325, 0.0792], 0.0300),
            ([0.0075, -0.0207, 0.0775], [0.0453, 0.0419, 0.0812], 0.0292),
        ],
    ];
    FITS[link - 1]
        .iter()
        .enumerate()
        .map(|(k, &(a, b, radius))| capsule(&format!("link{link}"), k, Role::Link(link as u8), a, b, radius))
        .collect()
}

pub(super) fn capsule(link: &str, k: usize, role: Role, a: [f64; 3], b: [f64; 3], radius: f64) -> Geom {
    let (pose, half_length) = between(a, b);
    Geom {
        name: format!("{link}_{k}"),
        shape: Shape::Capsule { half_length, radius },
        pose,
        friction: 1.0,
        role,
        color: [235, 235, 238],
    }
}

/// The pedestal on which robosuite mounts the arm.
fn pedestal() -> Vec<Geom> {
    let part = |name: &str, shape, [x, y, z]: [f64; 3]| Geom {
        name: name.into(),
        shape,
        pose: at([x, y, z + 0.01]),
        friction: 1.0,
        role: Role::Fixture,
        color: [90, 92, 98],
    };
    vec![
        part("pedestal_controller", Shape::Box(Vector3::new(0.11, 0.2, 0.265)), [-0.325, 0.0, -0.38]),
        part("pedestal_feet", Shape::Box(Vector3::new(0.385, 0.35, 0.155)), [-0.1225, 0.0, -0.758]),
        part("pedestal_column", Shape::Cylinder { half_length: 0.31, radius: 0.18 }, [-0.02, 0.0, -0.29]),
    ]
}
