//! The policy without the rest of the learner: for acting and evaluation.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::Config;
use crate::buffer::Matrix;
use crate::gaussian::{Samples, SquashedGaussian};
use crate::network::Networks;
use crate::pass::Pass;

/// How an action is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Act {
    /// tanh of the mean: evaluation.
    Mean,
    /// A sample of the policy: training.
    Sample,
    /// Uniform in [-1, 1], whatever is observed: the first steps of a run.
    Random,
}

/// A policy: a network from an observation to a distribution of actions, and the generator of its noise.
#[derive(Debug)]
pub struct Actor {
    /// `observation -> [mean of each action | raw log std of each action]`.
    pub(crate) network: Networks,
    pub(crate) policy: SquashedGaussian,
    pub(crate) rng: ChaCha8Rng,
    /// Memory for one observation on its way through the network; it holds nothing from one action to the next.
    observation: Matrix,
    pass: Pass,
    samples: Samples,
}

impl Actor {
    /// Name of the network in files.
    pub(crate) const NAMES: &[&str] = &["actor"];

    /// Sizes of the network's layers: input, hidden, output.
    pub(crate) fn sizes(config: &Config, observation_dim: usize, action_dim: usize) -> Vec<usize> {
        [&[observation_dim], config.hidden.as_slice(), &[2 * action_dim]].concat()
    }

    pub(crate) fn new(config: &Config, network: Networks, rng: ChaCha8Rng) -> Self {
        Self::with_policy(network, SquashedGaussian::new(config), rng)
    }

    fn with_policy(network: Networks, policy: SquashedGaussian, rng: ChaCha8Rng) -> Self {
        let [first, .., last] = network.sizes[..] else { unreachable!("a network has an input and an output") };
        let (observation, pass, samples) =
            (Matrix::zeros(1, first), Pass::new(&network, 1, false), Samples::zeros(last / 2));
        Self { network, policy, rng, observation, pass, samples }
    }

    /// Numbers in an observation.
    pub fn observation_dim(&self) -> usize {
        self.network.sizes[0]
    }

    /// Numbers in an action.
    pub fn action_dim(&self) -> usize {
        self.network.sizes.last().expect("an output size") / 2
    }

    /// Writes the action for `observation`, each entry in [-1, 1], into `action`.
    ///
    /// # Panics
    ///
    /// If a slice has the wrong length.
    pub fn act(&mut self, observation: &[f32], action: &mut [f32], mode: Act) {
        self.act_with(observation, action, mode, |_, rng| StandardNormal.sample(rng));
    }

    /// As [`Actor::act`], with noise from the caller: `noise(i, rng)` is the standard normal noise of entry `i`.
    pub(crate) fn act_with(
        &mut self,
        observation: &[f32],
        action: &mut [f32],
        mode: Act,
        mut noise: impl FnMut(usize, &mut ChaCha8Rng) -> f32,
    ) {
        let n = self.action_dim();
        assert_eq!(observation.len(), self.observation_dim(), "length of observation");
        assert_eq!(action.len(), n, "length of action");
        if mode == Act::Random {
            return action.fill_with(|| self.rng.random_range(-1.0..=1.0));
        }
        self.observation.copy_from_slice(observation);
        self.pass.forward(&self.network, &self.observation.view);
        let output = self.pass.result();
        if mode == Act::Mean {
            return action.iter_mut().zip(output).for_each(|(action, mean)| *action = self.policy.mean(*mean));
        }
        let noise: Vec<f32> = (0..n).map(|i| noise(i, &mut self.rng)).collect();
        self.policy.sample(output, &noise, n, &mut self.samples);
        action.iter_mut().enumerate().for_each(|(i, action)| *action = self.samples.action(i));
    }
}

impl Clone for Actor {
    fn clone(&self) -> Self {
        Self::with_policy(self.network.clone(), self.policy, self.rng.clone())
    }
}
