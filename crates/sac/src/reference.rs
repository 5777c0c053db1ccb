//! The losses of SAC as the papers write them, differentiated by libtorch's autograd. The crate's own derivatives are compared with them.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tch::{Kind, Tensor};

use crate::layer_norm;
use crate::network::Networks;
use crate::{Config, Replay, Sac, Sizes, Transition};

/// `networks` as a function of one vector of parameters, with autograd for that vector.
struct Differentiable<'a> {
    networks: &'a Networks,
    parameters: Tensor,
    layer_norm: bool,
}

impl<'a> Differentiable<'a> {
    fn new(networks: &'a Networks, layer_norm: bool) -> Self {
        Self { networks, parameters: Tensor::from_slice(&networks.values).set_requires_grad(true), layer_norm }
    }

    /// Outputs `(batch, output)` of the network called `name`, looked up by name to be independent of the order of the flat vector.
    fn forward(&self, name: &str, input: &Tensor) -> Tensor {
        let layers = self.networks.sizes.len() - 1;
        (0..layers).fold(input.shallow_clone(), |x, layer| {
            let [weight, bias] = ["weight", "bias"].map(|kind| {
                let name = format!("{name}.{}.{kind}", 2 * layer);
                let entry = self.networks.entries().into_iter().find(|e| e.name == name).unwrap();
                let shape: Vec<i64> = entry.shape.iter().map(|&n| n as i64).collect();
                self.parameters.narrow(0, entry.offset as i64, shape.iter().product()).view(shape.as_slice())
            });
            let y = x.matmul(&weight.tr()) + bias;
            let normal =
                |y: Tensor| y.layer_norm::<&Tensor>(&y.size()[1..], None, None, f64::from(layer_norm::EPSILON), false);
            match layer + 1 == layers {
                true => y,
                false if self.layer_norm => normal(y).relu(),
                false => y.relu(),
            }
        })
    }

    /// Values of both critics, `(batch)` each.
    fn twins(&self, input: &Tensor) -> [Tensor; 2] {
        ["critic_1", "critic_2"].map(|name| self.forward(name, input).squeeze_dim(-1))
    }

    fn gradient(&self, loss: &Tensor) -> Vec<f32> {
        Vec::try_from(&Tensor::run_backward(&[loss], &[&self.parameters], false, false)[0]).unwrap()
    }
}

/// (a `(batch, action)`, log pi(a|s) `(batch)`) for outputs of the actor `(batch, 2 action)` and standard normal noise `(batch, action)`.
/// Haarnoja et al., 2018, appendix C, in f64 and as printed there.
fn squashed_gaussian(config: &Config, output: &Tensor, noise: &Tensor) -> (Tensor, Tensor) {
    let (output, noise) = (output.to_kind(Kind::Double), noise.to_kind(Kind::Double));
    let parts = output.chunk(2, -1);
    let log_std = config.log_std_min + 0.5 * (config.log_std_max - config.log_std_min) * (parts[1].tanh() + 1.0);
    let action = (&parts[0] + log_std.exp() * &noise).tanh();
    let log_normal: Tensor = -0.5 * noise.square() - log_std - 0.5 * (2.0 * std::f64::consts::PI).ln();
    let log_slope: Tensor = (1f64 - action.square()).log();
    let log_prob = (log_normal - log_slope).sum_dim_intlist(-1, false, None);
    (action.to_kind(Kind::Float), log_prob.to_kind(Kind::Float))
}

/// A learner after 20 updates, on random data: temperature, targets and moments have all left their initial values.
fn learner(config: &Config, sizes: Sizes) -> (Sac, Replay) {
    let (observations, actions) = (sizes.whole_observation(), sizes.action);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut replay = Replay::new(config, sizes);
    for k in 0..300 {
        let mut numbers = |n| (0..n).map(|_| rng.random_range(-1.0..1.0)).collect::<Vec<f32>>();
        replay
            .push(&Transition {
                observation: &numbers(observations),
                action: &numbers(actions),
                reward: numbers(1)[0],
                next_observation: &numbers(observations),
                terminated: k % 10 == 9,
                truncated: k % 25 == 24,
            })
            .unwrap();
    }
    let mut sac = Sac::new(config, sizes, 5).unwrap();
    for _ in 0..20 {
        sac.update(&replay);
    }
    (sac, replay)
}

fn tensor(values: &[f32], columns: usize) -> Tensor {
    Tensor::from_slice(values).view([-1, columns as i64])
}

fn relative_error(a: &[f32], b: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len());
    let norm = |x: &mut dyn Iterator<Item = f64>| x.map(|x| x * x).sum::<f64>().sqrt();
    norm(&mut a.iter().zip(b).map(|(a, b)| f64::from(a - b))) / norm(&mut b.iter().map(|b| f64::from(*b)))
}

/// Compares one update of the crate with the same update by libtorch's autograd; f32 rounding leaves errors of about 1e-7.
#[test]
fn every_derivative_agrees_with_autograd() {
    let plain = Config { batch_size: 64, target_period: 1, ..Config::default() };
    let normal = Config { layer_norm: true, ..plain.clone() };
    for (hidden, observations, privileged, actions, config) in [
        (vec![32], 3, 0, 1, plain.clone()),
        (vec![64, 48], 11, 0, 4, plain.clone()),
        (vec![16, 24, 8], 5, 0, 7, plain.clone()),
        (vec![64, 48], 11, 0, 4, normal.clone()),
        (vec![19, 24, 8], 5, 0, 7, normal.clone()),
        (vec![32, 16], 5, 3, 2, plain),
        (vec![19, 24], 4, 9, 3, normal),
    ] {
        let config = Config { hidden, ..config };
        let sizes = Sizes { observation: observations, privileged, action: actions };
        let seen = sizes.whole_observation();
        let (mut sac, replay) = learner(&config, sizes);
        let (actor, critics, targets) = (sac.actor.network.clone(), sac.critics.clone(), sac.targets.clone());
        let alpha = f64::from(sac.temperature());
        let losses = sac.update(&replay);

        let (m, actors) = (&sac.scratch, losses.actor.unwrap());
        let (next_noise, noise) = (tensor(&m.next.noise, actions), tensor(&m.present.noise, actions));
        // The actor sees the first part of what the critics see.
        let of_actor = |seen: &Tensor| seen.narrow(1, 0, observations as i64);
        let present = tensor(&m.batch.input, seen + actions);
        let observation = present.narrow(1, 0, seen as i64);
        let next_observation = tensor(&m.batch.next_input, seen + actions).narrow(1, 0, seen as i64);
        let (reward, discount) = (Tensor::from_slice(&m.batch.reward), Tensor::from_slice(&m.batch.discount));

        // Critics: mean (Q_k(s, a) - y)^2, summed over k.
        let actor = Differentiable::new(&actor, false);
        let (next_action, next_log_prob) =
            squashed_gaussian(&config, &actor.forward("actor", &of_actor(&next_observation)), &next_noise);
        let next_input = Tensor::cat(&[next_observation, next_action], 1);
        let [next_1, next_2] = Differentiable::new(&targets, config.layer_norm).twins(&next_input);
        let next_value = next_1.minimum(&next_2) - alpha * next_log_prob;
        let y = (reward + discount * next_value).detach();
        let old_critics = Differentiable::new(&critics, config.layer_norm);
        let [loss_1, loss_2] = old_critics.twins(&present).map(|q| (q - &y).square().mean(Kind::Float));
        let loss = loss_1 + loss_2;
        approx::assert_relative_eq!(losses.critic_loss, f32::try_from(&loss).unwrap(), max_relative = 1e-5);
        let error = relative_error(&m.critic_gradient.values, &old_critics.gradient(&loss));
        assert!(error < 1e-5, "critics {:?}: {error}", config.hidden);

        // Actor: mean (alpha log pi - Q), with the critics after their step.
        let (action, log_prob) = squashed_gaussian(&config, &actor.forward("actor", &of_actor(&observation)), &noise);
        let new_critics = Differentiable::new(&sac.critics, config.layer_norm);
        let [q_1, q_2] = new_critics.twins(&Tensor::cat(&[observation, action], 1));
        let q = q_1.minimum(&q_2);
        let loss = (alpha * &log_prob - &q).mean(Kind::Float);
        approx::assert_relative_eq!(actors.loss, f32::try_from(&loss).unwrap(), epsilon = 1e-5);
        approx::assert_relative_eq!(actors.q_mean, f32::try_from(q.mean(Kind::Float)).unwrap(), epsilon = 1e-6);
        let error = relative_error(&m.actor_gradient.values, &actor.gradient(&loss));
        assert!(error < 1e-5, "actor {:?}: {error}", config.hidden);

        // Targets: theta' + tau (theta - theta').
        for ((new, old), critic) in sac.targets.values.iter().zip(targets.values.iter()).zip(sac.critics.values.iter())
        {
            approx::assert_relative_eq!(*new, 0.995 * old + 0.005 * critic, epsilon = 1e-6);
        }
        // The temperature rises exactly when the entropy is below its target.
        assert_eq!(f64::from(losses.temperature) > alpha, actors.entropy < -(actions as f32));
    }
}
