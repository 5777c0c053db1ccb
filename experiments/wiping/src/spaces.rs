//! The action spaces that are compared.

use aforce::ActionSpace;
use toml::{Table, Value};

/// Place of the adaptive space among [`Setup::spaces`](crate::Setup::spaces).
pub const AFORCE: usize = 0;
/// Place of the space that the others are compared with.
pub const HIGH: usize = 3;

const FILE: &str = include_str!("spaces.toml");

/// The adaptive space, and the fixed stiffnesses low, mid and high. Each has the same force controller, and the name of
/// the built-in space that it extends.
pub(crate) fn spaces() -> [ActionSpace; 4] {
    let mut file: Table = FILE.parse().expect("the built-in file is TOML");
    let Some(Value::Array(spaces)) = file.remove("space") else { panic!("the built-in file lists spaces") };
    let spaces = spaces.into_iter().map(|space| {
        let record: Table = space.try_into().expect("a space is a table");
        let name = record["extends"].as_str().expect("a space extends a built-in one").to_owned();
        ActionSpace::from_table(record, &name).expect("a built-in record")
    });
    spaces.collect::<Vec<_>>().try_into().expect("four spaces")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::setup::Setup;
    use crate::trial::Trial;
    use aforce::OperationalSpace;
    use physics::scenes::wipe::scene;
    use physics::wiping_tool::GRIP_SITE;

    /// Stability is certified for the largest apparent inertia, in any direction.
    #[test]
    fn nominal_inertia_covers_the_arm() {
        let setup = Setup::default();
        let Trial { height, friction, start, .. } = Trial::nominal();
        let (scene, tool) = scene(&setup.arm(), height, friction);
        let model = physics::model::Model::new(&scene, tool, GRIP_SITE);
        let y = model.measure(start, start * 0.0, aforce::Wrench::zeros());
        let arm = OperationalSpace::new(&y.mass, &y.jacobian).unwrap();
        let psi = setup.spaces[AFORCE].psi().unwrap();
        for (inertia, nominal) in [(arm.lambda_p, psi.inertia[0]), (arm.lambda_o, psi.inertia[3])] {
            let heaviest = inertia.symmetric_eigenvalues().max();
            assert!((0.6..1.0).contains(&(heaviest / nominal)), "{heaviest}");
        }
    }
}
