//! Franka Research 3, from franka_description 0.4.0 (Franka Robotics, Apache-2.0, commit b299b39 of March 2025).
//!
//! Its frames and its collision meshes are those of the Panda: in that package `kinematics.yaml` and `collision/*.stl` are the same
//! files for both arms. Ranges, speeds and torques are in [`Arm::FR3`]; rotors and drives are the Panda's.

use std::array;
use std::f64::consts::SQRT_2;

use aforce::Arm;

use super::panda::{self, inertial, links};
use super::{GripperInertials, JOINTS, Robot, tool_pose};
use crate::scene::{Inertial, at, pose};

/// Mass of each link (kg) and its centre (m, link frame).
const MASSES: [(f64, [f64; 3]); JOINTS] = [
    (2.9274653454, [0.0000004128, -0.0181251324, -0.0386035970]),
    (2.9355370338, [0.0031828864, -0.0743221644, 0.0088146084]),
    (2.2449013699, [0.0407015686, -0.0048200565, -0.0289730823]),
    (2.6155955791, [-0.0459100965, 0.0630492960, -0.0085187868]),
    (2.3271207594, [-0.0016039605, 0.0292536262, -0.0972965990]),
    (1.8170376524, [0.0597131221, -0.0410294666, -0.0101692726]),
    (0.6271432862, [0.0045225817, 0.0086261921, -0.0161633251]),
];

/// Moments of inertia xx, yy, zz of each link about its centre of mass, along the axes of the link (kg m2).
const MOMENTS: [[f64; 3]; JOINTS] = [
    [0.023927316485107913, 0.0224821613275756, 0.006350098258530016],
    [0.041938946257609425, 0.02514514885014724, 0.06170214472888839],
    [0.02410142547240885, 0.01974053266708178, 0.019044494482244823],
    [0.03452998321913202, 0.028881621933049058, 0.04125471171146641],
    [0.051610278463662895, 0.04787729713371481, 0.016423625579357254],
    [0.005412333594383447, 0.014058329545509979, 0.016080817924212554],
    [0.00021092389150104718, 0.00017718568002411474, 5.993190599659971e-05],
];

/// Products of inertia xy, xz, yz of the same.
const PRODUCTS: [[f64; 3]; JOINTS] = [
    [1.3317903455714081e-05, -0.00011404774918616684, -0.0019950320628240115],
    [0.00020257331521090626, 0.004077784227179924, -0.0042252158006570156],
    [0.002404694559042109, -0.002856269270114313, -0.002104212683891874],
    [0.01322552265982813, 0.01015142998484113, -0.0009762833870704552],
    [-0.005715173387783472, -0.0035673167625872135, 0.010673985108535986],
    [0.006193456360285834, 0.0014219289306117652, -0.0013140753741120031],
    [-2.433299114461931e-05, 4.564480393778983e-05, 8.744070223226438e-05],
];

/// An FR3 with Franka's hand. Values that are not given here are the identified Panda's.
pub fn fr3() -> Robot {
    let inertials = array::from_fn(|i| {
        let (mass, com) = MASSES[i];
        let ([xx, yy, zz], [xy, xz, yz]) = (MOMENTS[i], PRODUCTS[i]);
        inertial(mass, com, [xx, yy, zz, xy, xz, yz])
    });
    Robot {
        name: "fr3".into(),
        arm: Arm::FR3,
        // `dynamics.yaml`: damping 0.003 Nm s/rad, friction 0.2 Nm.
        links: links(inertials, [0.003; JOINTS], [0.2; JOINTS]),
        // Turned by -45 degrees about z; tan(pi/8) = sqrt(2) - 1.
        flange: pose([0.0, 0.0, 0.107], [1.0, 0.0, 0.0, 1.0 - SQRT_2]),
        flange_inertial: Inertial::NONE,
        gripper: GripperInertials {
            // The maker's hand has the frame of the flange, and its fingers begin 6 mm farther out than the gripper's here.
            palm: inertial(0.6544, [-0.0000376, 0.0119128, 0.0207260], [0.00186, 0.00030, 0.00174, 0.0, 0.0, -0.00002])
                .transformed(&tool_pose(0.0).inverse()),
            finger: inertial(0.0291, [0.0, 0.0152850, 0.0219675], [8.49e-6, 8.53e-6, 1.77e-6, 0.0, 0.0, -1.06e-6])
                .transformed(&at([0.0, 0.0, 0.006])),
            tip: Inertial::NONE, // The maker's finger above includes it.
        },
        ..panda::identified()
    }
}
