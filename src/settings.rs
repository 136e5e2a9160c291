//! The settings of a render as one table: name, kind, default, doc. Scene files, command-line flags and the C
//! interface are all fed from it.

use std::str::FromStr;

/// How light is transported.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Integrator {
    /// Chosen from what the scene contains.
    Auto,
    /// Path tracing with next-event estimation.
    Pt,
    /// Light tracing.
    Lt,
    /// Bidirectional path tracing, one light subpath for each eye subpath.
    Bpt,
    /// Connections to uniform picks from the light-vertex cache.
    Lvc,
    /// As `Lvc`, with hierarchical Russian roulette at glossy eye vertices.
    LvcHrr,
}

/// What answers ray queries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Backend {
    /// Intel Embree.
    Embree,
    /// obvhs, pure Rust.
    Obvhs,
    /// Every triangle; for tests.
    Brute,
}

/// Everything a render can be told. The contract is SCENE FORMAT; the table and its parsing are being written.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Transport algorithm.
    pub integrator: Integrator,
    /// Longest path, in segments: 1 = emitters seen directly, 2 = direct light.
    pub max_depth: u32,
    /// Ray query backend.
    pub visibility: Backend,
    /// Iterations to run (each `samples` eye samples per pixel).
    pub iterations: u64,
    /// First iteration's number, so that a render can be split and added up.
    pub first_iteration: u64,
    /// Seconds of rendering instead of a number of iterations.
    pub time: Option<f64>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Threads; 0 = all.
    pub threads: usize,
    /// Eye samples per pixel and iteration.
    pub samples: u32,
    /// Light subpaths per iteration; 0 = as many as pixels.
    pub light_subpaths: u64,
    /// Connections that the uniform picks (`lvc`) try at each eye vertex.
    pub connections: u32,
    /// Expected number of light vertices that the roulette keeps where its probabilities stay below 1 (k).
    pub expected: f64,
    /// Largest GGX roughness at which the roulette is used.
    pub hrr_alpha: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            integrator: Integrator::Auto,
            max_depth: 24,
            visibility: if cfg!(feature = "embree") { Backend::Embree } else { Backend::Obvhs },
            iterations: 64,
            first_iteration: 0,
            time: None,
            seed: 0,
            threads: 0,
            samples: 1,
            light_subpaths: 0,
            connections: 1,
            expected: 1.0,
            hrr_alpha: 0.3,
        }
    }
}

impl FromStr for Integrator {
    type Err = String;
    fn from_str(s: &str) -> Result<Self, String> {
        Ok(match s {
            "auto" => Self::Auto,
            "pt" => Self::Pt,
            "lt" => Self::Lt,
            "bpt" => Self::Bpt,
            "lvc" => Self::Lvc,
            "lvc+hrr" => Self::LvcHrr,
            _ => return Err(format!("unknown integrator '{s}'")),
        })
    }
}

impl Settings {
    /// Sets one by name (stub until the table is merged).
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), String> {
        match key {
            "integrator" => self.integrator = value.parse()?,
            "max_depth" => self.max_depth = value.parse().map_err(|e| format!("{key}: {e}"))?,
            "iterations" => self.iterations = value.parse().map_err(|e| format!("{key}: {e}"))?,
            "seed" => self.seed = value.parse().map_err(|e| format!("{key}: {e}"))?,
            _ => return Err(format!("unknown key '{key}' in [render]")),
        }
        Ok(())
    }
}
