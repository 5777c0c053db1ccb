//! Pixels as a part of an observation.

use aforce::{ConfigError, within};
use physics::{Simulation, View};
use serde::{Deserialize, Serialize};

use crate::task::Task;

/// Largest depth of a pixel, also the depth where nothing is seen (m).
pub const FARTHEST: f64 = 5.0;

/// A camera whose pictures are observed beside the numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ObservedCamera {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// What a pixel's numbers are.
    pub kind: PixelKind,
    /// Where the camera stands.
    pub from: Standpoint,
}

/// What a pixel's numbers are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PixelKind {
    /// Distance of the seen surface from the plane of the camera (m).
    Depth,
    /// Red, green, blue, with shadows.
    Rgb,
}

/// Where a camera stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Standpoint {
    /// At the task's own camera ([`Task::camera`](crate::Task::camera)).
    Task,
    /// Beside the hand, looking at a point 2 cm beyond the tool point.
    Hand,
}

/// A picture, row by row from the top left corner.
#[derive(Debug, Clone, PartialEq)]
pub enum Pixels {
    /// One number for each pixel (m), at most [`FARTHEST`].
    Depth(Vec<f32>),
    /// Three for each pixel.
    Rgb(Vec<u8>),
}

/// Form of the pictures.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct PixelForm {
    /// Rows, columns, numbers for each pixel.
    pub shape: [u32; 3],
    /// Largest number.
    pub high: f64,
    /// Unit of the numbers.
    pub unit: &'static str,
}

impl Default for ObservedCamera {
    fn default() -> Self {
        ObservedCamera { width: 84, height: 84, kind: PixelKind::Depth, from: Standpoint::Task }
    }
}

impl ObservedCamera {
    /// Checks every value.
    ///
    /// # Errors
    /// The first value that is not allowed, with its field (below `observation`) and range.
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        within("observation.camera.width", f64::from(self.width), 1.0..=1024.0)?;
        within("observation.camera.height", f64::from(self.height), 1.0..=1024.0)
    }

    /// The form of the camera's pictures.
    pub(crate) fn form(&self) -> PixelForm {
        let (channels, high, unit) = match self.kind {
            PixelKind::Depth => (1, FARTHEST, "m"),
            PixelKind::Rgb => (3, 255.0, "1"),
        };
        PixelForm { shape: [self.height, self.width, channels], high, unit }
    }

    /// The camera's present picture.
    pub(crate) fn take(&self, task: &dyn Task, simulation: &Simulation) -> Pixels {
        let view = match self.from {
            Standpoint::Task => task.camera().view(),
            // From the true pose of the tool, not the measured one.
            Standpoint::Hand => View::from_hand(&simulation.measure().pose),
        };
        let [width, height] = [self.width, self.height].map(|pixels| pixels as usize);
        match self.kind {
            PixelKind::Depth => Pixels::Depth(view.depths(simulation, FARTHEST, width, height)),
            PixelKind::Rgb => Pixels::Rgb(view.colors(simulation, &task.decals(), width, height).rgb),
        }
    }
}
