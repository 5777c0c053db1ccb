//! The Franka Emika Panda: kinematics, inertia, joints and shapes of its seven links.

use aforce::{Arm, JointVector, Pose, TorqueLimits, Vector3};
use nalgebra::{Matrix3, Rotation3, SVector, UnitQuaternion, Vector3 as V3};
use serde::{Deserialize, Serialize};

use crate::scene::{Actuator, Air, Axis, Body, Geom, Inertial, Joint, Role, Scene, Shape, Stop, at, between, pose};

/// Joint angles at the start of an episode before noise (rad).
pub const HOME: [f64; 7] = [
    0.0,
    std::f64::consts::PI / 16.0,
    0.0,
    -5.0 * std::f64::consts::PI / 6.0,
    0.0,
    std::f64::consts::PI - 0.2,
    std::f64::consts::PI / 4.0,
];

/// Joint ranges (rad).
pub const RANGE: [[f64; 2]; 7] = Arm::PANDA.range;

/// Largest speed of each joint, either way (rad/s).
pub const SPEED_MAX: [f64; 7] = Arm::PANDA.speed_max;

/// Frame of each link in its parent (the joint turns about the link's own z).
const LINK_FRAMES: [([f64; 3], [f64; 4]); 7] = {
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

/// Which numbers describe the arm's dynamics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ParameterSet {
    /// The round numbers of robosuite's Panda, with its rotor inertia of 5/(i+1) kg m2 and its air, which takes
    /// 6 to 9 Nm from a joint at 1 rad/s: results are comparable with what is published for its tasks.
    #[default]
    Robosuite,
    /// Parameters identified on a real arm (Gaz et al., RA-L 2019, as carried by
    /// franka_description), with the rotor inertia and torque limits of the maker.
    Identified,
}

/// Everything that sets one Panda's dynamics apart from another's.
#[derive(Debug, Clone)]
pub struct Parameters {
    /// Links 1 to 7, in the link frames.
    pub links: [Inertial; 7],
    /// What is fixed to the flange, in the frame called `right_hand`.
    pub hand: Inertial,
    /// The gripper without its fingers, in the gripper frame.
    pub gripper: Inertial,
    /// One finger without its tip, in its own frame; the left one (the right is its mirror image).
    pub finger: Inertial,
    /// The tip of a finger, in its own frame.
    pub tip: Inertial,
    /// Viscous damping per joint (Nm s/rad).
    pub damping: JointVector,
    /// Dry friction per joint (Nm).
    pub friction: JointVector,
    /// Rotor inertia reflected to the joint (kg m2).
    pub armature: JointVector,
    /// Largest torque (Nm).
    pub max_torque: JointVector,
    /// Largest change of torque per second (Nm/s); `None`: unlimited.
    pub max_torque_rate: Option<JointVector>,
    /// What the scene's bodies move through. Its drag is no part of what a controller compensates.
    pub air: Option<Air>,
}

impl Parameters {
    /// What the joints can take.
    pub fn torque_limits(&self) -> TorqueLimits {
        TorqueLimits::new(self.max_torque, self.max_torque_rate).expect("limits of an arm")
    }
}

impl ParameterSet {
    /// The numbers.
    pub fn parameters(self) -> Parameters {
        match self {
            ParameterSet::Robosuite => robosuite(),
            ParameterSet::Identified => identified(),
        }
    }
}

fn robosuite() -> Parameters {
    let link = |mass, com, i: f64| Inertial::diagonal(mass, com, [i; 3]);
    Parameters {
        links: [
            link(3.0, [0.0, 0.0, -0.07], 0.3),
            link(3.0, [0.0, -0.1, 0.0], 0.3),
            link(2.0, [0.04, 0.0, -0.05], 0.2),
            link(2.0, [-0.04, 0.05, 0.0], 0.2),
            link(2.0, [0.0, 0.0, -0.15], 0.2),
            link(1.5, [0.06, 0.0, 0.0], 0.1),
            link(0.5, [0.0, 0.0, 0.08], 0.05),
        ],
        hand: link(0.5, [0.0; 3], 0.05),
        // Principal moments 0.09, 0.07, 0.05 in axes turned by +90 degrees about x.
        gripper: Inertial::diagonal(0.3, [0.0, 0.0, 0.17], [0.09, 0.05, 0.07]),
        finger: Inertial::diagonal(0.1, [0.0, 0.0, 0.05], [0.01, 0.01, 0.005]),
        tip: Inertial::diagonal(0.01, [0.0; 3], [0.01; 3]),
        damping: SVector::from([0.1, 0.1, 0.1, 0.1, 0.1, 0.01, 0.01]),
        friction: SVector::from([0.1; 7]),
        armature: JointVector::from_fn(|i, _| 5.0 / (i as f64 + 1.0)),
        max_torque: SVector::from([80.0, 80.0, 80.0, 80.0, 80.0, 12.0, 12.0]),
        max_torque_rate: None,
        air: Some(Air { density: 1.2, viscosity: 2e-5 }),
    }
}

fn identified() -> Parameters {
    // Inertia as (xx, yy, zz, xy, xz, yz) about the centre of mass.
    let link = |mass, com: [f64; 3], [xx, yy, zz, xy, xz, yz]: [f64; 6]| Inertial {
        mass,
        com: com.into(),
        inertia: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
    };
    Parameters {
        links: [
            link(4.970684, [0.003875, 0.002081, -0.04762], [0.70337, 0.70661, 0.009117, -0.000139, 0.006772, 0.019169]),
            link(
                0.646926,
                [-0.003141, -0.02872, 0.003495],
                [0.007962, 0.02811, 0.025995, -0.003925, 0.010254, 0.000704],
            ),
            link(
                3.228604,
                [0.027518, 0.039252, -0.066502],
                [0.037242, 0.036155, 0.01083, -0.004761, -0.011396, -0.012805],
            ),
            link(
                3.587895,
                [-0.05317, 0.104419, 0.027454],
                [0.025853, 0.019552, 0.028323, 0.007796, -0.001332, 0.008641],
            ),
            link(
                1.225946,
                [-0.011953, 0.041065, -0.038437],
                [0.035549, 0.029474, 0.008627, -0.002117, -0.004037, 0.000229],
            ),
            link(
                1.666555,
                [0.060149, -0.014117, -0.010517],
                [0.001964, 0.004354, 0.005433, 0.000109, -0.001158, 0.000341],
            ),
            link(
                0.735522,
                [0.010517, -0.004252, 0.061597],
                [0.012516, 0.010027, 0.004815, -0.000428, -0.001196, -0.000741],
            ),
        ],
        hand: Inertial::diagonal(0.73, [-0.01, 0.0, 0.03], [0.001, 0.0025, 0.0017]),
        gripper: Inertial::NONE, // The maker's hand above includes it.
        finger: Inertial::diagonal(0.015, [0.0; 3], [2.375e-6, 2.375e-6, 7.5e-7]),
        tip: Inertial::NONE, // The maker's finger above includes it.
        damping: SVector::from([1.0; 7]),
        friction: SVector::from([0.0; 7]),
        armature: SVector::from(Arm::PANDA.rotor_inertia),
        max_torque: SVector::from(Arm::PANDA.torque_max),
        max_torque_rate: Some(SVector::from(Arm::PANDA.torque_rate_max)),
        air: None,
    }
}

/// Adds the base and the seven links to `scene`; returns the index of `right_hand`, the
/// frame at the flange that carries a tool. The parameters' air fills the scene.
pub fn add_arm(scene: &mut Scene, parameters: &Parameters, base: Pose) -> usize {
    scene.air = parameters.air;
    let base = scene.add(Body {
        name: "link0".into(),
        parent: None,
        pose: base,
        joint: Joint::Fixed,
        inertial: Inertial::NONE,
        geoms: vec![capsule("link0", 0, Role::Fixture, [-0.0573, 0.0, 0.0628], [-0.0003, 0.0, 0.0517], 0.075)],
    });
    let mut parent = base;
    for i in 0..7 {
        let name = format!("link{}", i + 1);
        let (position, wxyz) = LINK_FRAMES[i];
        parent = scene.add(Body {
            parent: Some(parent),
            pose: pose(position, wxyz),
            joint: Joint::Hinge(Axis {
                name: format!("joint{}", i + 1),
                direction: V3::z_axis(),
                range: RANGE[i],
                damping: parameters.damping[i],
                friction: parameters.friction[i],
                armature: parameters.armature[i],
                spring: 0.0,
                stop: Stop::Constraint,
            }),
            inertial: parameters.links[i],
            geoms: link_geoms(i + 1),
            name,
        });
        scene.actuators.push(Actuator { joint: format!("joint{}", i + 1), max_effort: parameters.max_torque[i] });
    }
    scene.add(Body {
        name: "right_hand".into(),
        parent: Some(parent),
        pose: pose([0.0, 0.0, 0.1065], [0.924, 0.0, 0.0, -0.383]),
        joint: Joint::Fixed,
        inertial: parameters.hand,
        geoms: vec![],
    })
}

/// Two capsules per link, least-squares fits to the convex hulls of the maker's meshes
/// (outside and inside by about 1 cm).
fn link_geoms(link: usize) -> Vec<Geom> {
    type Capsule = ([f64; 3], [f64; 3], f64);
    const FITS: [[Capsule; 2]; 7] = [
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

fn capsule(link: &str, k: usize, role: Role, a: [f64; 3], b: [f64; 3], radius: f64) -> Geom {
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

/// The pedestal on which robosuite mounts the arm, `base` being the arm's base frame.
pub fn pedestal(base: &Pose) -> Vec<Geom> {
    let part = |name: &str, shape, position: [f64; 3]| Geom {
        name: name.into(),
        shape,
        pose: base * at([position[0], position[1], position[2] + 0.01]),
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

/// Rotation from the frame `right_hand` to the tool frame that hangs below it.
pub fn tool_rotation() -> UnitQuaternion<f64> {
    pose([0.0; 3], [std::f64::consts::FRAC_1_SQRT_2, 0.0, 0.0, -std::f64::consts::FRAC_1_SQRT_2]).rotation
}

/// Rotation of a tool that faces straight down, its x axis (the wiping tool's long side) along y (world).
pub fn facing_down() -> UnitQuaternion<f64> {
    let axes = [V3::y(), V3::x(), -V3::z()];
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_basis_unchecked(&axes))
}
