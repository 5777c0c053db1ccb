//! The numbers that an update reports.

use crate::simd::wide;

/// The numbers that an update reports, averaged over its batch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Losses {
    /// Sum of both critics' mean squared errors, in reward^2.
    pub critic_loss: f32,
    /// Euclidean norm of the critics' gradient.
    pub grad_norm_critic: f32,
    /// alpha after the update, in reward per nat.
    pub temperature: f32,
    /// Numbers of the actor's step, if this update made one.
    pub actor: Option<ActorLosses>,
}

/// The numbers that a step of the actor reports, averaged over its batch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActorLosses {
    /// mean(alpha log pi - Q), in reward, where Q is the smaller of the two critics' values.
    pub loss: f32,
    /// -mean(log pi), in nat.
    pub entropy: f32,
    /// Mean of that Q for the policy's own actions, in reward. If it rises while returns fall, the critics overestimate.
    pub q_mean: f32,
    /// Euclidean norm of the actor's gradient.
    pub grad_norm: f32,
}

impl Losses {
    /// Whether every number is finite. If not, learning has diverged and cannot recover.
    pub fn is_finite(&self) -> bool {
        let Self { critic_loss, grad_norm_critic, temperature, actor } = *self;
        let of_actor = actor.map_or([0.0; 4], |a| [a.loss, a.entropy, a.q_mean, a.grad_norm]);
        [critic_loss, grad_norm_critic, temperature].iter().chain(&of_actor).all(|x| x.is_finite())
    }
}

pub(crate) fn mean(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / values.len() as f32
}

/// Euclidean norm.
pub(crate) fn norm(values: &[f32]) -> f32 {
    let mut sums = [0.0f64; 8];
    let (chunks, rest) = values.as_chunks::<8>();
    add_squares(chunks, &mut sums);
    let rest = rest.iter().map(|&x| f64::from(x) * f64::from(x)).sum::<f64>();
    (sums.iter().sum::<f64>() + rest).sqrt() as f32
}

wide! {
    /// Eight partial sums side by side. In a single sum each addition would wait for the one before, and the norm would
    /// take a twentieth of the update.
    fn add_squares(chunks: &[[f32; 8]], sums: &mut [f64; 8]) {
        for chunk in chunks {
            for (sum, &x) in sums.iter_mut().zip(chunk) {
                *sum += f64::from(x) * f64::from(x);
            }
        }
    }
}
