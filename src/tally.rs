//! What the work has cost so far: counters and seconds of each stage, added up over threads.

use crate::roulette::QueryCounters;
use std::time::Instant;

/// Counts and seconds; each thread fills its own, then they are added.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tally {
    /// Rays from the camera.
    pub camera_rays: u64,
    /// Light subpaths emitted.
    pub light_subpaths: u64,
    /// Light vertices cached.
    pub light_vertices: u64,
    /// Roulette queries and what they visited.
    pub roulette: QueryCounters,
    /// Squares of how many light vertices each of these queries kept.
    pub kept_squares: u64,
    /// Roulette queries over points of lights, and what they visited.
    pub emitters: QueryCounters,
    /// Shadow rays of connections of any kind.
    pub connection_rays: u64,
    /// Those of them that met nothing.
    pub visible_connections: u64,
    /// Light vertices merged with eye vertices.
    pub merged: u64,
    /// Seconds tracing light subpaths, their connections to the camera included.
    pub light_trace: f64,
    /// Seconds by the clock on the wall until the eye side began, and of the eye side if it took all samples that were planned.
    pub sides: [f64; 2],
    /// Seconds building the vertex BVH.
    pub vertex_bvh_build: f64,
    /// Seconds on the eye side, less `roulette` and `visibility`.
    pub eye_trace: f64,
    /// Seconds in roulette queries.
    pub roulette_seconds: f64,
    /// Seconds playing the roulette: in its queries, and in connections to what they keep. Part of the other sums.
    pub playing: f64,
    /// The roulette's work in those seconds alone, scaled up as they are: they are those of a sample of the tiles, and what it has
    /// to do differs by tile.
    pub played_work: f64,
    /// Seconds in the eye side's shadow rays.
    pub visibility: f64,
    /// Seconds adding to the film.
    pub film: f64,
}

impl Tally {
    /// Adds another's counts and seconds.
    pub fn add(&mut self, other: &Self) {
        self.camera_rays += other.camera_rays;
        self.light_subpaths += other.light_subpaths;
        self.light_vertices += other.light_vertices;
        self.roulette.add(&other.roulette);
        self.kept_squares += other.kept_squares;
        self.emitters.add(&other.emitters);
        self.connection_rays += other.connection_rays;
        self.visible_connections += other.visible_connections;
        self.merged += other.merged;
        self.light_trace += other.light_trace;
        self.sides = [0, 1].map(|i| self.sides[i] + other.sides[i]);
        self.vertex_bvh_build += other.vertex_bvh_build;
        self.eye_trace += other.eye_trace;
        self.roulette_seconds += other.roulette_seconds;
        self.playing += other.playing;
        self.played_work += other.played_work;
        self.visibility += other.visibility;
        self.film += other.film;
    }

    /// The sum of two, for folding.
    pub fn plus(mut self, other: Self) -> Self {
        self.add(&other);
        self
    }

    /// Takes out of `eye_trace` what stands in the sums of its own.
    pub fn less_parts_of_eye_trace(mut self) -> Self {
        self.eye_trace = (self.eye_trace - self.roulette_seconds - self.visibility).max(0.0);
        self
    }

    /// Counts a shadow ray; returns `free` again.
    pub fn connection(&mut self, free: bool) -> bool {
        self.connection_rays += 1;
        self.visible_connections += u64::from(free);
        free
    }
}

/// A clock that can be off: reading the time around every shadow ray would cost as much as a tenth of the ray, so
/// only a sample of the work is timed, and scaled up.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    /// What a measured second counts for; 0: do not measure.
    scale: f64,
}

impl Clock {
    /// A clock that runs in one of `every` pieces of work.
    pub fn sampled(piece: usize, every: usize) -> Self {
        Self { scale: if piece.is_multiple_of(every) { every as f64 } else { 0.0 } }
    }

    /// A clock that never runs.
    pub fn off() -> Self {
        Self { scale: 0.0 }
    }

    /// What something that was counted while the clock may have been off counts for.
    #[inline]
    pub fn count(self, n: f64) -> f64 {
        n * self.scale
    }

    /// Runs `work`, adding its seconds to `sum` when this piece is timed.
    #[inline]
    pub fn time<T>(self, sum: &mut f64, work: impl FnOnce() -> T) -> T {
        if self.scale == 0.0 {
            return work();
        }
        let start = Instant::now();
        let result = work();
        *sum += start.elapsed().as_secs_f64() * self.scale;
        result
    }
}
