//! The identified parameter set weighs what its authors published: C. Gaz, M. Cognetti, A. Oliva,
//! P. Robuffo Giordano, A. De Luca, "Dynamic Identification of the Franka Emika Panda Robot With
//! Retrieval of Feasible Parameters Using Penalty-Based Optimization", IEEE RA-L 4(4), 2019.

use aforce::{Pose, Vector3};
use physics::robots::{Robot, RobotName};
use physics::scene::{Inertial, Scene};

/// Moments (kg m, along x and y of the link frame) that the links 2 to 7 carry about their joint,
/// each with everything distal of it that does not turn with the joints between. The coefficients
/// of the gravity vector in the authors' own code (github.com/marcocognetti/FrankaEmikaPandaDynModel,
/// get_GravityVector.m): least-squares estimates from motions of a real arm without a hand.
const PUBLISHED: [[f64; 2]; 6] = [
    [0.005_368_784_261_474_552, -3.102_575_671_767_16],
    [0.687_353_310_277_526_2, 0.023_376_494_573_717_96],
    [-0.488_836_024_633_242_9, 1.718_488_169_611_198],
    [-0.010_003_952_253_559_1, 0.077_053_241_958_930_29],
    [0.165_680_968_759_300_8, -0.067_711_741_442_479_46],
    [0.006_230_758_965_393_622, -0.000_488_352_108_512_765_7],
];

/// The link masses and centres of mass are a second step from those estimates, a search for
/// physically possible ones; what they leave over is at most 9 g at arm's length of 1 m.
#[test]
fn gravity_moments_are_the_published_ones() {
    let robot = Robot { flange_inertial: Inertial::NONE, ..RobotName::Identified.robot() };
    let mut scene = Scene::default();
    robot.add_to(&mut scene, Pose::identity());
    // What a link's child hands on to it: mass at the child's origin, and the child's moment along
    // its own joint axis, which does not change as the joint turns.
    let (mut mass, mut handed) = (0.0, Vector3::zeros());
    for i in (2..=7).rev() {
        let link = &scene.bodies[scene.body(&format!("link{i}"))];
        let moment = link.inertial.mass * link.inertial.com + handed;
        let [x, y] = PUBLISHED[i - 2];
        assert!((moment.x - x).abs() < 0.01 && (moment.y - y).abs() < 0.01, "link {i}: {moment} against {x}, {y}");
        mass += link.inertial.mass;
        handed = link.pose.rotation * Vector3::new(0.0, 0.0, moment.z) + mass * link.pose.translation.vector;
    }
}
