//! Soft Actor-Critic (Haarnoja et al., 2018, arXiv 1812.05905) in the form of pytorch_sac: twin critics with slowly moving targets, and a
//! temperature that steers the entropy.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::actor::{Act, Actor};
use crate::adam::Adam;
use crate::losses::{ActorLosses, Losses, mean, norm};
use crate::network::Networks;
use crate::nudge::Nudges;
use crate::pink::Pink;
use crate::replay::Replay;
use crate::scratch::Scratch;
use crate::simd::wide;
use crate::{Config, Error, Sizes};

/// The learner: an actor and its running mean, twin critics, their targets, a temperature, and the optimisers' state.
#[derive(Debug)]
pub struct Sac {
    pub(crate) config: Config,
    pub(crate) sizes: Sizes,
    /// The actor that learns and explores.
    pub(crate) actor: Actor,
    /// Running mean of the actor's parameters: the policy that is evaluated.
    pub(crate) average: Networks,
    /// Two critics: `[observation | what only the critics see | action] -> value`.
    pub(crate) critics: Networks,
    pub(crate) targets: Networks,
    /// log alpha, so that alpha stays positive after any step.
    pub(crate) log_temperature: f32,
    pub(crate) actor_adam: Adam,
    pub(crate) critic_adam: Adam,
    pub(crate) temperature_adam: Adam,
    /// Updates made so far.
    pub(crate) updates: u64,
    pub(crate) batch_rng: ChaCha8Rng,
    pub(crate) noise_rng: ChaCha8Rng,
    /// Pink noise of the present episode; `None` if its noise is white. Not saved: a run continues from checkpoints between episodes.
    pink: Option<Pink>,
    /// Nudges of the present episode, if it has any. Not saved either.
    nudges: Option<Nudges>,
    pub(crate) scratch: Scratch,
}

/// Streams of random numbers, one for each purpose: a new use must not shift the numbers of the others.
#[derive(Debug, Clone, Copy)]
enum Stream {
    Initialisation,
    Acting,
    Batches,
    Noise,
}

impl Sac {
    /// A learner with fresh weights. The same seed gives the same bits, from here to the last update.
    ///
    /// # Errors
    ///
    /// [`Error::Config`] if a setting is out of range, or if this process multiplies with other kernels already.
    pub fn new(config: &Config, sizes: impl Into<Sizes>, seed: u64) -> Result<Self, Error> {
        config.validate()?;
        config.kernels.insist()?;
        let stream = |stream: Stream| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(stream as u64);
            rng
        };
        let mut sac = Self::zeros(config, sizes.into());
        let mut rng = stream(Stream::Initialisation);
        sac.actor.network.initialise(&mut rng);
        sac.average.values.copy_from_slice(&sac.actor.network.values);
        sac.critics.initialise(&mut rng);
        sac.targets.values.copy_from_slice(&sac.critics.values);
        sac.actor.rng = stream(Stream::Acting);
        sac.batch_rng = stream(Stream::Batches);
        sac.noise_rng = stream(Stream::Noise);
        Ok(sac)
    }

    /// A learner of the right sizes whose weights and generators are yet to be set.
    pub(crate) fn zeros(config: &Config, sizes: Sizes) -> Self {
        let rng = ChaCha8Rng::seed_from_u64(0);
        let network = Networks::zeros(Actor::NAMES, &Actor::sizes(config, sizes.observation, sizes.action));
        let actor = Actor::new(config, network, rng.clone());
        let layers = [&[sizes.whole_observation() + sizes.action], config.hidden.as_slice(), &[1]].concat();
        let critics = Networks::zeros(&["critic_1", "critic_2"], &layers);
        Self {
            log_temperature: libm::log(config.initial_temperature) as f32,
            actor_adam: Adam::new(actor.network.values.len()),
            critic_adam: Adam::new(critics.values.len()),
            temperature_adam: Adam::new(1),
            updates: 0,
            batch_rng: rng.clone(),
            noise_rng: rng,
            pink: None,
            nudges: None,
            scratch: Scratch::new(config, sizes, &actor, &critics),
            sizes,
            targets: critics.clone(),
            average: actor.network.clone(),
            config: config.clone(),
            actor,
            critics,
        }
    }

    /// Call this at the start of each episode. Draws whether the episode has pink noise, the initial state of that noise, and whether the
    /// episode has nudges.
    pub fn begin_episode(&mut self) {
        // Nothing is drawn for an option that is off, so that a run without the option has the same bytes as before the option existed.
        let in_this_one = |share: f64, rng: &mut ChaCha8Rng| share > 0.0 && rng.random_bool(share);
        let (actions, rng) = (self.actor.action_dim(), &mut self.actor.rng);
        self.pink = in_this_one(self.config.pink_noise, rng).then(|| Pink::new(actions, rng));
        self.nudges = in_this_one(self.config.nudges, rng).then(Nudges::default);
    }

    /// Writes the action for `observation`, each entry in [-1, 1], into `action`. `observation` is the actor's part
    /// alone.
    ///
    /// # Panics
    ///
    /// If a slice has the wrong length.
    pub fn act(&mut self, observation: &[f32], action: &mut [f32], mode: Act) {
        match &mut self.pink {
            Some(pink) => self.actor.act_with(observation, action, mode, |i, rng| pink.next(i, rng)),
            None => self.actor.act(observation, action, mode),
        }
        if let (Some(nudges), Act::Sample) = (&mut self.nudges, mode) {
            nudges.apply(action, &mut self.actor.rng);
        }
    }

    /// The present policy for evaluation and storage: the running mean of the actor. Its noise comes from `seed`, so that evaluation does
    /// not shift the noise of training.
    pub fn policy(&self, seed: u64) -> Actor {
        Actor::new(&self.config, self.average.clone(), ChaCha8Rng::seed_from_u64(seed))
    }

    /// The settings.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Lengths of observations and actions.
    pub fn sizes(&self) -> Sizes {
        self.sizes
    }

    /// Updates made so far.
    pub fn updates(&self) -> u64 {
        self.updates
    }

    /// Weight of the entropy, in reward per nat.
    pub fn temperature(&self) -> f32 {
        libm::expf(self.log_temperature)
    }

    /// Learns from one batch drawn from `replay`.
    ///
    /// # Panics
    ///
    /// If `replay` is empty or its transitions have other sizes.
    pub fn update(&mut self, replay: &Replay) -> Losses {
        self.learn_from(&[replay])
    }

    /// Learns from a batch of which half is drawn from `replay` and half from `prior`, transitions that this learner did not collect (RLPD:
    /// Ball et al., 2023, arXiv 2302.02948).
    ///
    /// # Panics
    ///
    /// As [`Sac::update`].
    pub fn update_with_prior(&mut self, replay: &Replay, prior: &Replay) -> Losses {
        self.learn_from(&[replay, prior])
    }

    /// Learns from a batch with equally many transitions from each memory; if the batch is odd, the last memory gives one more.
    fn learn_from(&mut self, memories: &[&Replay]) -> Losses {
        let n = self.config.batch_size;
        for (k, replay) in memories.iter().enumerate() {
            assert_eq!(replay.whole_observation, self.sizes.whole_observation(), "observations in the replay memory");
            assert_eq!(replay.action_dim, self.sizes.action, "actions in the replay memory");
            let places = k * n / memories.len()..(k + 1) * n / memories.len();
            replay.sample(places, &mut self.batch_rng, &mut self.scratch.batch);
        }
        let noise_rng = &mut self.noise_rng;
        for drawn in [&mut self.scratch.next, &mut self.scratch.present] {
            drawn.noise.fill_with(|| StandardNormal.sample(noise_rng));
        }
        self.learn()
    }

    /// One update from the batch and the noise in the scratch space.
    pub(crate) fn learn(&mut self) -> Losses {
        self.updates += 1;
        let (critic_loss, grad_norm_critic) = self.critic_step();
        let actor = self.updates.is_multiple_of(self.config.actor_period).then(|| {
            let losses = self.actor_step();
            self.average_step();
            self.temperature_step(losses.entropy);
            losses
        });
        self.target_step();
        Losses { critic_loss, grad_norm_critic, temperature: self.temperature(), actor }
    }

    /// Number of steps of the actor so far, the present one included.
    fn actor_steps(&self) -> u64 {
        self.updates / self.config.actor_period
    }

    /// Moves both critics towards y = r + discount (min Q_target(s', a') - alpha log pi(a'|s')). Returns loss and norm of the gradient.
    fn critic_step(&mut self) -> (f32, f32) {
        let alpha = self.temperature();
        let Scratch { batch, next, done, critic_pass, target_pass, critic_gradient, .. } = &mut self.scratch;
        next.draw(&self.actor, &batch.next_input);
        target_pass.forward(&self.targets, &next.input.view);
        done.copy_from_slice(&batch.input);
        critic_pass.forward(&self.critics, &done.view);

        let share = 1.0 / batch.reward.len() as f32;
        let mut loss = 0.0;
        // Each row holds the values of both critics.
        let (values, gradient) = critic_pass.result_and_gradient();
        let (values, gradient) = (values.as_chunks::<2>().0, gradient.as_chunks_mut::<2>().0);
        let targets = target_pass.result().as_chunks::<2>().0;
        for (i, ([next_1, next_2], (values, gradient))) in targets.iter().zip(values.iter().zip(gradient)).enumerate() {
            let next_value = next_1.min(*next_2);
            let y = batch.reward[i] + batch.discount[i] * (next_value - alpha * next.log_prob[i]);
            for (value, gradient) in values.iter().zip(gradient) {
                let error = value - y;
                *gradient = 2.0 * share * error;
                loss += share * (error * error);
            }
        }
        critic_pass.backward(&self.critics);
        critic_pass.parameter_gradient(&done.view, critic_gradient);
        let gradient = &critic_gradient.values;
        self.critic_adam.step(&mut self.critics.values, gradient, self.config.critic_learning_rate, self.updates);
        (loss, norm(gradient))
    }

    /// Moves the actor down mean(alpha log pi(a|s) - Q(s, a)), with a = tanh(mean + std noise) differentiable in the actor's
    /// parameters, and Q the smaller of both values.
    fn actor_step(&mut self) -> ActorLosses {
        let (alpha, t) = (self.temperature(), self.actor_steps());
        let Scratch { batch, present, critic_pass, actor_gradient, action_gradient, .. } = &mut self.scratch;
        present.draw(&self.actor, &batch.input);
        critic_pass.forward(&self.critics, &present.input.view);

        let (observations, actions) = (self.sizes.whole_observation(), self.sizes.action);
        let share = 1.0 / self.config.batch_size as f32;
        let mut q_mean = 0.0;
        let (values, gradient) = critic_pass.result_and_gradient();
        for (&[q1, q2], gradient) in values.as_chunks::<2>().0.iter().zip(gradient.as_chunks_mut::<2>().0) {
            let (q, by_values) = if q1 <= q2 { (q1, [-share, 0.0]) } else { (q2, [0.0, -share]) };
            q_mean += share * q;
            *gradient = by_values;
        }
        critic_pass.backward(&self.critics);
        critic_pass.input_gradient(&self.critics, observations, action_gradient);

        let gradients = present.pass.result_and_gradient().1.chunks_exact_mut(2 * actions);
        let by_action = action_gradient.chunks_exact(actions);
        for (row, (gradient, by_action)) in gradients.zip(by_action).enumerate() {
            for i in 0..actions {
                (gradient[i], gradient[actions + i]) =
                    present.samples.backward(row * actions + i, by_action[i], alpha * share);
            }
        }
        present.pass.backward(&self.actor.network);
        present.pass.parameter_gradient(&present.observations, actor_gradient);
        let entropy = -mean(&present.log_prob);
        let gradient = &actor_gradient.values;
        self.actor_adam.step(&mut self.actor.network.values, gradient, self.config.actor_learning_rate, t);
        ActorLosses { loss: -alpha * entropy - q_mean, entropy, q_mean, grad_norm: norm(gradient) }
    }

    /// Moves the averaged policy towards the actor. For its first 1 / `policy_average` steps it is the plain mean of
    /// all actors so far.
    fn average_step(&mut self) {
        let share = self.config.policy_average.max(1.0 / self.actor_steps() as f64) as f32;
        blend(&mut self.average.values, &self.actor.network.values, share);
    }

    /// Moves log alpha down mean(alpha (-log pi - target entropy)): up if the entropy is below its target.
    fn temperature_step(&mut self, entropy: f32) {
        let target = self.config.target_entropy.unwrap_or(-(self.actor.action_dim() as f64));
        let gradient = self.temperature() * (entropy - target as f32);
        let t = self.actor_steps();
        let log_temperature = std::slice::from_mut(&mut self.log_temperature);
        self.temperature_adam.step(log_temperature, &[gradient], self.config.temperature_learning_rate, t);
    }

    /// Moves the targets a fraction tau towards the critics.
    fn target_step(&mut self) {
        if self.updates.is_multiple_of(self.config.target_period) {
            blend(&mut self.targets.values, &self.critics.values, self.config.tau as f32);
        }
    }
}

wide! {
    /// Moves `slow` the fraction `share` of the way to `fast` (Polyak averaging).
    fn blend(slow: &mut [f32], fast: &[f32], share: f32) {
        for (slow, fast) in slow.iter_mut().zip(fast) {
            *slow += share * (fast - *slow);
        }
    }
}

#[cfg(test)]
mod tests;
