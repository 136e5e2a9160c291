//! Lights: choosing one, points and directions on it, and the densities of both.

pub mod source;
mod joined;
pub mod area;
pub mod lamp;
pub mod distant;
pub mod environment;
pub mod point;
pub mod choice;
pub mod lights;

pub mod guide;

pub use area::{AreaLights, EmitterPoint};
pub use choice::Place;
pub use environment::Environment;
pub use guide::EmissionGuide;
pub use lights::Lights;
pub use point::LightPoint;
pub use source::LightSource;
