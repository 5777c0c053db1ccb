//! A robot from its URDF: lengths, masses, ranges, limits and shapes of the joints between the base and a tool.
//!
//! The file may have any serial arm of seven or six revolute joints, about any axes. Joints off the way to the tool, a gripper's for
//! instance, are welded at zero. Links may have any names: in a scene they are called link1 to link7.

mod arm;
mod document;
mod element;
mod error;
mod meshes;
mod shapes;

pub use arm::{Capsule, Choices, robot};
pub use document::Document;
pub use error::UrdfError;
pub use meshes::MeshFolders;
