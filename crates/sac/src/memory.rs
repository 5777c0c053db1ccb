//! What one update works on, made once.

use crate::Config;
use crate::actor::Actor;
use crate::buffer::Buffer;
use crate::gaussian::Sample;
use crate::network::Networks;
use crate::pass::Pass;
use crate::replay::Batch;

/// What one update works on; holds nothing from one update to the next.
#[derive(Debug)]
pub(crate) struct Memory {
    pub batch: Batch,
    /// Standard normal, `(2 batch, action)`: first for the next observations, then for the present ones.
    pub noise: Vec<f32>,
    /// Samples of the policy, `(2 batch, action)`, in the same order.
    pub samples: Vec<Sample>,
    /// log pi, `(2 batch)`, in the same order.
    pub log_prob: Vec<f32>,
    /// `(2 batch, observation + action)`, in the same order.
    pub inputs: Buffer,
    /// `(batch, action)`.
    pub action_gradient: Buffer,
    pub actor_gradient: Networks,
    pub critic_gradient: Networks,
    pub actor_pass: Pass,
    pub critic_pass: Pass,
    pub target_pass: Pass,
}

/// Which half of the rows of [`Memory`].
#[derive(Debug, Clone, Copy)]
pub(crate) enum Half {
    Next,
    Present,
}

impl Memory {
    pub fn new(config: &Config, actor: &Actor, critics: &Networks) -> Self {
        let n = config.batch_size;
        let (observations, actions) = (actor.observation_dim(), actor.action_dim());
        Self {
            batch: Batch::default(),
            noise: vec![0.0; 2 * n * actions],
            samples: vec![Sample::default(); 2 * n * actions],
            log_prob: vec![0.0; 2 * n],
            inputs: Buffer::zeros(2 * n * (observations + actions)),
            action_gradient: Buffer::zeros(n * actions),
            actor_gradient: actor.network.clone(),
            critic_gradient: critics.clone(),
            actor_pass: Pass::new(&actor.network, 2 * n, n),
            critic_pass: Pass::new(critics, n, n),
            target_pass: Pass::new(critics, n, 0),
        }
    }

    /// Half of the inputs of the critics, `(batch, observation + action)`.
    pub fn input(&self, half: Half) -> tch::Tensor {
        let rows = self.log_prob.len() / 2;
        let length = self.inputs.len() / 2;
        self.inputs.view(half as usize * length, &[rows, length / rows])
    }

    /// Puts the policy's actions into that half.
    pub fn write_actions(&mut self, half: Half) -> tch::Tensor {
        let rows = self.log_prob.len() / 2;
        let actions = self.action_gradient.len() / rows;
        let (length, samples) = (self.inputs.len() / 2, self.samples.len() / 2);
        let inputs = self.inputs[half as usize * length..].chunks_exact_mut(length / rows).take(rows);
        for (input, samples) in inputs.zip(self.samples[half as usize * samples..].chunks_exact(actions)) {
            let at = input.len() - actions;
            for (x, sample) in input[at..].iter_mut().zip(samples) {
                *x = sample.action;
            }
        }
        self.input(half)
    }

    pub fn present<'a>(&self, values: &'a [f32]) -> &'a [f32] {
        &values[values.len() / 2..]
    }
}
