//! robosuite's wiping tool: a compliant pad below the flange, without joints or motors.

use aforce::{JointVector, Vector3, Wrench};
use nalgebra::{Rotation3, UnitQuaternion};

use crate::model::Model;
use crate::robots::tool_pose;
use crate::scene::{Body, Geom, Inertial, Joint, Pad, Role, Scene, Shape, at};

/// Middle of the contact face in the tool frame (m): the point that the arm controls.
pub const GRIP_SITE: [f64; 3] = [0.0, 0.0, 0.015];
/// Half extents of a rail (m); the face is two of them, long in x, side by side in y.
const RAIL_HALF: [f64; 3] = [0.06, 0.01, 0.015];
/// Distance of a rail's middle from the tool's (m).
const RAIL_Y: f64 = 0.02;
/// Names of the two rails' geoms.
pub const RAILS: [&str; 2] = ["left_rail", "right_rail"];
/// Stiffness of the level face against a hard surface (N/m), as measured in robosuite up
/// to 25 N. In robosuite it rises to 68 kN/m at 127 N.
const STIFFNESS: f64 = 45_000.0;
/// Damping ratio of each point of contact. The arm on the whole face has the damping
/// ratio of one point times the square root of the number of points, about 0.4 in all.
const DAMPING_RATIO: f64 = 0.15;
/// How far the face gives way (m), which the level face does under 450 N. robosuite's face has no such limit: a tool that is
/// pressed on with kilonewtons lies centimetres deep in the table.
const TRAVEL: f64 = 0.01;
/// Number of points of contact of the level face: the corners of both rails.
const CORNERS: f64 = 8.0;

/// Adds the tool below `right_hand`; returns its body, which carries the grip site.
///
/// robosuite's rails are rows of seven boxes each, with gaps of 5 to 10 mm. The cross bars
/// between them (recessed by 1 cm) and the marker balls at the edge (which carry 0.03 N)
/// are left out.
pub fn add_wiping_tool(scene: &mut Scene, right_hand: usize) -> usize {
    let rail = |name: &str, y| Geom {
        name: name.into(),
        shape: Shape::Box(RAIL_HALF.into()),
        pose: at([0.0, y, 0.0]),
        friction: 0.001,
        role: Role::Tool,
        color: [52, 120, 190],
    };
    scene.add(Body {
        name: "wiping_tool".into(),
        parent: Some(right_hand),
        pose: tool_pose(0.015),
        joint: Joint::Fixed,
        inertial: Inertial::diagonal(0.03, [0.0; 3], [0.01; 3]),
        geoms: vec![rail(RAILS[0], RAIL_Y), rail(RAILS[1], -RAIL_Y)],
    })
}

/// The tool's soft layer against the geom `surface` (its place in the scene).
///
/// The damping is relative to the effective mass of a corner: the mass that a vertical push meets there while all joints of the arm, at
/// `home` (rad), are free to move.
pub fn pad(model: &Model, home: &JointVector, surface: usize) -> Pad {
    let k = model.kinematics(home);
    let (jacobian, mass) = (model.jacobian(&k), model.mass(&k).cholesky().expect("a mass matrix"));
    let mut total = 0.0;
    for (x, y) in [-1.0, 1.0].into_iter().flat_map(|x| [-1.0, 1.0].map(|y| (x, y))) {
        for side in [-RAIL_Y, RAIL_Y] {
            let corner = k.tool.rotation * Vector3::new(x * RAIL_HALF[0], side + y * RAIL_HALF[1], 0.0);
            let turn = corner.cross(&Vector3::z());
            let push = jacobian.tr_mul(&Wrench::new(0.0, 0.0, 1.0, turn.x, turn.y, turn.z));
            total += 1.0 / push.dot(&mass.solve(&push));
        }
    }
    let damping = 2.0 * DAMPING_RATIO * (STIFFNESS * total).sqrt();
    Pad { surface, stiffness: STIFFNESS / CORNERS, damping: damping / CORNERS, travel: TRAVEL }
}

/// Rotation of a tool that faces straight down, its x axis (the wiping tool's long side) along y (world).
pub fn facing_down() -> UnitQuaternion<f64> {
    let axes = [Vector3::y(), Vector3::x(), -Vector3::z()];
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_basis_unchecked(&axes))
}
