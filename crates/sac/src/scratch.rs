//! Memory in which updates work, allocated once.

use tch::Tensor;

use crate::actor::Actor;
use crate::buffer::Matrix;
use crate::gaussian::Samples;
use crate::network::Networks;
use crate::pass::Pass;
use crate::replay::Batch;
use crate::{Config, Sizes};

/// Memory in which an update works; it holds nothing from one update to the next.
#[derive(Debug)]
pub(crate) struct Scratch {
    pub batch: Batch,
    /// The policy's actions for the next observations.
    pub next: Drawn,
    /// The policy's actions for the present observations.
    pub present: Drawn,
    /// `(batch, whole observation + action)`: the observations with the actions that were taken.
    pub done: Matrix,
    /// `(batch, action)`.
    pub action_gradient: Matrix,
    pub actor_gradient: Networks,
    pub critic_gradient: Networks,
    pub critic_pass: Pass,
    pub target_pass: Pass,
}

/// The policy's actions for a batch of observations.
#[derive(Debug)]
pub(crate) struct Drawn {
    /// Numbers that the critics see besides an action.
    whole_observation: usize,
    /// Standard normal, `(batch, action)`.
    pub noise: Vec<f32>,
    /// `(batch, action)`.
    pub samples: Samples,
    /// log pi, `(batch)`.
    pub log_prob: Vec<f32>,
    /// The observations with the policy's actions, `(batch, whole observation + action)`: the input of the critics.
    pub input: Matrix,
    /// `(batch, observation)`: the actor's part.
    pub observations: Tensor,
    pub pass: Pass,
}

impl Scratch {
    pub fn new(config: &Config, sizes: Sizes, actor: &Actor, critics: &Networks) -> Self {
        let n = config.batch_size;
        let (observations, actions) = (sizes.whole_observation(), sizes.action);
        let critic_pass = |back| {
            let pass = Pass::new(critics, n, back);
            if config.layer_norm { pass.normalised(critics) } else { pass }
        };
        Self {
            batch: Batch::zeros(n, observations, actions),
            next: Drawn::new(actor, sizes, n, false),
            present: Drawn::new(actor, sizes, n, true),
            done: Matrix::zeros(n, observations + actions),
            action_gradient: Matrix::zeros(n, actions),
            actor_gradient: actor.network.clone(),
            critic_gradient: critics.clone(),
            critic_pass: critic_pass(true),
            target_pass: critic_pass(false),
        }
    }
}

impl Drawn {
    fn new(actor: &Actor, sizes: Sizes, rows: usize, back: bool) -> Self {
        let (whole_observation, actions) = (sizes.whole_observation(), sizes.action);
        let input = Matrix::zeros(rows, whole_observation + actions);
        Self {
            whole_observation,
            noise: vec![0.0; rows * actions],
            samples: Samples::zeros(rows * actions),
            log_prob: vec![0.0; rows],
            observations: input.columns(0..sizes.observation),
            input,
            pass: Pass::new(&actor.network, rows, back),
        }
    }

    /// a ~ pi(.|s) and log pi(a|s) for the observations in `rows`, `(batch, whole observation + action)`, from the noise.
    pub fn draw(&mut self, actor: &Actor, rows: &[f32]) {
        self.input.copy_from_slice(rows);
        self.pass.forward(&actor.network, &self.observations);
        let actions = actor.action_dim();
        actor.policy.sample(self.pass.result(), &self.noise, actions, &mut self.samples);
        let rows = self.log_prob.iter_mut().zip(self.input.chunks_exact_mut(self.whole_observation + actions));
        for (row, (log_prob, input)) in rows.enumerate() {
            *log_prob = 0.0;
            for i in 0..actions {
                *log_prob += self.samples.log_prob(row * actions + i);
                input[self.whole_observation + i] = self.samples.action(row * actions + i);
            }
        }
    }
}
