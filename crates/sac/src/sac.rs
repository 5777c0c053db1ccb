//! Soft Actor-Critic (Haarnoja et al., 2018, arXiv 1812.05905) in the form of pytorch_sac: twin critics with slowly moving targets, and a
//! temperature that steers the entropy.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::actor::{Act, Actor};
use crate::adam::Adam;
use crate::losses::{Losses, mean, norm};
use crate::memory::{Half, Memory};
use crate::network::Networks;
use crate::replay::Replay;
use crate::{Config, Error};

/// The learner: an actor and its running mean, twin critics, their targets, a temperature, and the optimisers' state.
#[derive(Debug)]
pub struct Sac {
    pub(crate) config: Config,
    /// Learns, and explores.
    pub(crate) actor: Actor,
    /// Running mean of the actor's parameters: what is evaluated.
    pub(crate) average: Networks,
    /// `[observation | action] -> value`, twice.
    pub(crate) critics: Networks,
    pub(crate) targets: Networks,
    /// log alpha: alpha stays positive whatever the step.
    pub(crate) log_temperature: f32,
    pub(crate) actor_adam: Adam,
    pub(crate) critic_adam: Adam,
    pub(crate) temperature_adam: Adam,
    /// Updates made so far.
    pub(crate) updates: u64,
    pub(crate) batch_rng: ChaCha8Rng,
    pub(crate) noise_rng: ChaCha8Rng,
    pub(crate) memory: Memory,
}

/// Streams of random numbers, one for each purpose: a new consumer must not shift the others.
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
    /// [`Error::Config`] if a setting is out of range.
    pub fn new(config: &Config, observation_dim: usize, action_dim: usize, seed: u64) -> Result<Self, Error> {
        config.validate()?;
        let stream = |stream: Stream| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(stream as u64);
            rng
        };
        let mut sac = Self::zeros(config, observation_dim, action_dim);
        let rng = &mut stream(Stream::Initialisation);
        sac.actor.network.initialise(rng);
        sac.average.values.copy_from_slice(&sac.actor.network.values);
        sac.critics.initialise(rng);
        sac.targets.values.copy_from_slice(&sac.critics.values);
        sac.actor.rng = stream(Stream::Acting);
        sac.batch_rng = stream(Stream::Batches);
        sac.noise_rng = stream(Stream::Noise);
        Ok(sac)
    }

    /// A learner of the right sizes whose weights and generators are yet to be set.
    pub(crate) fn zeros(config: &Config, observation_dim: usize, action_dim: usize) -> Self {
        crate::threads::use_one();
        let rng = ChaCha8Rng::seed_from_u64(0);
        let actor = Actor::zeros(config, observation_dim, action_dim, rng.clone());
        let sizes = [&[observation_dim + action_dim], config.hidden.as_slice(), &[1]].concat();
        let critics = Networks::zeros(&["critic_1", "critic_2"], &sizes);
        Self {
            log_temperature: config.initial_temperature.ln() as f32,
            actor_adam: Adam::new(actor.network.values.len()),
            critic_adam: Adam::new(critics.values.len()),
            temperature_adam: Adam::new(1),
            updates: 0,
            batch_rng: rng.clone(),
            noise_rng: rng,
            memory: Memory::new(config, &actor, &critics),
            targets: critics.clone(),
            average: actor.network.clone(),
            config: config.clone(),
            actor,
            critics,
        }
    }

    /// Writes the action for `observation`, each entry in [-1, 1], into `action`.
    ///
    /// # Panics
    ///
    /// If a slice has the wrong length.
    pub fn act(&mut self, observation: &[f32], action: &mut [f32], mode: Act) {
        self.actor.act(observation, action, mode);
    }

    /// The policy as it stands: the running mean of the actor, to be evaluated and kept. Its noise comes from `seed`, so that evaluating
    /// it does not shift the noise of training.
    pub fn policy(&self, seed: u64) -> Actor {
        let rng = ChaCha8Rng::seed_from_u64(seed);
        Actor { network: self.average.clone(), policy: self.actor.policy, rng }
    }

    /// The settings.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Updates made so far.
    pub fn updates(&self) -> u64 {
        self.updates
    }

    /// Weight of the entropy, in reward per nat.
    pub fn temperature(&self) -> f32 {
        self.log_temperature.exp()
    }

    /// Learns from one batch drawn from `replay`.
    ///
    /// # Panics
    ///
    /// If `replay` is empty or its transitions have other sizes.
    pub fn update(&mut self, replay: &Replay) -> Losses {
        assert_eq!(replay.observation_dim, self.actor.observation_dim(), "observations in the replay memory");
        assert_eq!(replay.action_dim, self.actor.action_dim(), "actions in the replay memory");
        replay.sample(self.config.batch_size, &mut self.batch_rng, &mut self.memory.batch);
        let noise_rng = &mut self.noise_rng;
        self.memory.noise.fill_with(|| StandardNormal.sample(noise_rng));
        self.learn()
    }

    /// One update from the batch and the noise in memory.
    pub(crate) fn learn(&mut self) -> Losses {
        self.updates += 1;
        self.sample_actions();
        let (critic_loss, grad_norm_critic) = self.critic_step();
        let (q_mean, grad_norm_actor) = self.actor_step();
        let entropy = -mean(self.memory.present(&self.memory.log_prob));
        let actor_loss = -self.temperature() * entropy - q_mean;
        self.average_step();
        self.temperature_step(entropy);
        self.target_step();
        Losses {
            critic_loss,
            actor_loss,
            temperature: self.temperature(),
            entropy,
            q_mean,
            grad_norm_critic,
            grad_norm_actor,
        }
    }

    /// a ~ pi(.|s) and log pi(a|s) for the next and the present observations, in one pass.
    fn sample_actions(&mut self) {
        let Memory { batch, noise, samples, log_prob, inputs, actor_pass, .. } = &mut self.memory;
        let half = inputs.len() / 2;
        inputs[..half].copy_from_slice(&batch.next_input);
        inputs[half..].copy_from_slice(&batch.input);
        let (observations, actions) = (self.actor.observation_dim(), self.actor.action_dim());
        let rows = log_prob.len();
        let width = observations + actions;
        actor_pass.forward(&self.actor.network, &inputs.view(0, &[rows, width]).narrow(1, 0, observations as i64));

        let outputs = actor_pass.result().chunks_exact(2 * actions);
        let rows = outputs.zip(noise.chunks_exact(actions)).zip(samples.chunks_exact_mut(actions)).zip(log_prob);
        for (((output, noise), samples), log_prob) in rows {
            let (mean, raw_log_std) = output.split_at(actions);
            *log_prob = 0.0;
            for i in 0..actions {
                samples[i] = self.actor.policy.sample(mean[i], raw_log_std[i], noise[i]);
                *log_prob += samples[i].log_prob;
            }
        }
    }

    /// Moves both critics towards y = r + discount (min Q_target(s', a') - alpha log pi(a'|s')). Returns loss and norm of the gradient.
    fn critic_step(&mut self) -> (f32, f32) {
        let alpha = self.temperature();
        let memory = &mut self.memory;
        let next = memory.write_actions(Half::Next);
        memory.target_pass.forward(&self.targets, &next);
        let present = memory.input(Half::Present);
        memory.critic_pass.forward(&self.critics, &present);

        let Memory { batch, log_prob, critic_pass, target_pass, critic_gradient, .. } = memory;
        let n = batch.reward.len();
        let mut loss = 0.0;
        for (i, [q1, q2]) in target_pass.result().as_chunks::<2>().0.iter().enumerate() {
            let y = batch.reward[i] + batch.discount[i] * (q1.min(*q2) - alpha * log_prob[i]);
            for q in 2 * i..2 * i + 2 {
                let error = critic_pass.result()[q] - y;
                loss += error * error / n as f32;
                critic_pass.result_gradient()[q] = 2.0 * error / n as f32;
            }
        }
        critic_pass.backward(&self.critics);
        critic_pass.parameter_gradient(&present, critic_gradient);
        let gradient = &critic_gradient.values;
        self.critic_adam.step(&mut self.critics.values, gradient, self.config.critic_learning_rate, self.updates);
        (loss, norm(gradient))
    }

    /// Moves the actor down mean(alpha log pi(a|s) - min Q(s, a)), with a = tanh(mean + std noise) differentiable in the actor's
    /// parameters. Returns mean of min Q and norm of the gradient.
    fn actor_step(&mut self) -> (f32, f32) {
        let alpha = self.temperature();
        let memory = &mut self.memory;
        let present = memory.write_actions(Half::Present);
        memory.critic_pass.forward(&self.critics, &present);

        let Memory { samples, critic_pass, actor_pass, actor_gradient, action_gradient, .. } = memory;
        let (observations, actions) = (self.actor.observation_dim(), self.actor.action_dim());
        let n = self.config.batch_size;
        let mut q_mean = 0.0;
        for i in 0..n {
            let (q1, q2) = (critic_pass.result()[2 * i], critic_pass.result()[2 * i + 1]);
            q_mean += q1.min(q2) / n as f32;
            // Only the smaller value carries the derivative.
            let (d1, d2) = if q1 <= q2 { (-1.0, 0.0) } else { (0.0, -1.0) };
            critic_pass.result_gradient()[2 * i] = d1 / n as f32;
            critic_pass.result_gradient()[2 * i + 1] = d2 / n as f32;
        }
        critic_pass.backward(&self.critics);
        critic_pass.input_gradient(&self.critics, observations, action_gradient);

        let present_samples = samples[n * actions..].chunks_exact(actions);
        let gradients = actor_pass.result_gradient().chunks_exact_mut(2 * actions);
        for ((gradient, samples), by_action) in
            gradients.zip(present_samples).zip(action_gradient.chunks_exact(actions))
        {
            for i in 0..actions {
                (gradient[i], gradient[actions + i]) = samples[i].backward(by_action[i], alpha / n as f32);
            }
        }
        actor_pass.backward(&self.actor.network);
        actor_pass.parameter_gradient(&present.narrow(1, 0, observations as i64), actor_gradient);
        let gradient = &actor_gradient.values;
        self.actor_adam.step(&mut self.actor.network.values, gradient, self.config.actor_learning_rate, self.updates);
        (q_mean, norm(gradient))
    }

    /// Moves the policy towards the actor; at first it is the plain mean of all actors so far.
    fn average_step(&mut self) {
        let share = self.config.policy_average.max(1.0 / self.updates as f64) as f32;
        blend(&mut self.average.values, &self.actor.network.values, share);
    }

    /// Moves log alpha down mean(alpha (-log pi - target entropy)): up if the entropy is below its target.
    fn temperature_step(&mut self, entropy: f32) {
        let target = self.config.target_entropy.unwrap_or(-(self.actor.action_dim() as f64));
        let gradient = self.temperature() * (entropy - target as f32);
        let log_temperature = std::slice::from_mut(&mut self.log_temperature);
        self.temperature_adam.step(log_temperature, &[gradient], self.config.temperature_learning_rate, self.updates);
    }

    /// Moves the targets a fraction tau towards the critics.
    fn target_step(&mut self) {
        if self.updates.is_multiple_of(self.config.target_period) {
            blend(&mut self.targets.values, &self.critics.values, self.config.tau as f32);
        }
    }
}

/// Moves `slow` the fraction `share` of the way to `fast` (Polyak averaging).
fn blend(slow: &mut [f32], fast: &[f32], share: f32) {
    for (slow, fast) in slow.iter_mut().zip(fast) {
        *slow += share * (fast - *slow);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Transition;

    #[test]
    fn the_policy_is_a_running_mean_of_the_actor() {
        let config = Config { hidden: vec![8], batch_size: 4, policy_average: 0.3, ..Config::default() };
        let mut sac = Sac::new(&config, 2, 1, 3).unwrap();
        let mut replay = Replay::new(&config, 2, 1);
        for k in 0..10 {
            let observe = |k: u8| [f32::from(k).sin(), f32::from(k).cos()];
            replay
                .push(&Transition {
                    observation: &observe(k),
                    action: &[0.5],
                    reward: observe(k)[0],
                    next_observation: &observe(k + 1),
                    terminated: k == 9,
                    truncated: false,
                })
                .unwrap();
        }
        let weights = |sac: &mut Sac| {
            sac.update(&replay);
            sac.actor.network.values.to_vec()
        };
        let actors: Vec<_> = (0..4).map(|_| weights(&mut sac)).collect();
        for (i, &average) in sac.average.values.iter().enumerate() {
            // The plain mean of three, for 1/3 is more than 0.3, and then 0.3 of the way to the fourth.
            let mean = (actors[0][i] + actors[1][i] + actors[2][i]) / 3.0;
            assert!((average - (0.7 * mean + 0.3 * actors[3][i])).abs() < 1e-6, "{i}: {average}");
        }
        assert_ne!(sac.average.values[0], sac.actor.network.values[0]);
    }
}
