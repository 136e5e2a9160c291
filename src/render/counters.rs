//! What a render did and cost, as `--stats` writes it.

use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::AddAssign;

/// The statistics of one render. Serialised, its names are a contract: they stay what they are.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Stats {
    /// The version of hrr.
    pub version: String,
    /// The scene as the user named it.
    pub scene: String,
    /// The integrator that ran; never `auto`.
    pub integrator: String,
    /// The ray query backend.
    pub visibility: String,
    /// Threads that ran; never 0.
    pub threads: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Iterations that were finished.
    pub iterations: u64,
    /// Effects of the scene and the verdict on each.
    pub effects: BTreeMap<String, String>,
    /// Names of the machinery that ran.
    pub machinery: Vec<String>,
    /// Whether light is missing from the image, because an effect that the scene calls for was left out.
    pub biased: bool,
    /// What took how long.
    pub seconds: Seconds,
    /// What was done how often.
    pub counters: Counters,
    /// What took how much space.
    pub memory: Memory,
}

/// Seconds of each stage, summed over threads; `render` and `total` are wall-clock time.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Seconds {
    /// Reading the scene.
    pub load: f64,
    /// Building the structure that answers ray queries.
    pub accel_build: f64,
    /// Tracing light subpaths.
    pub light_trace: f64,
    /// Building the BVH over light vertices.
    pub vertex_bvh_build: f64,
    /// Tracing eye subpaths, without `roulette` and `visibility`.
    pub eye_trace: f64,
    /// Choosing light vertices.
    pub roulette: f64,
    /// Shadow rays of connections.
    pub visibility: f64,
    /// Adding to the film.
    pub film: f64,
    /// From the first iteration's start to the last one's end; wall-clock time.
    pub render: f64,
    /// From the program's start until all images are written; wall-clock time.
    pub total: f64,
}

/// How often things were done, over all iterations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Counters {
    /// Eye subpaths.
    pub camera_rays: u64,
    /// Light subpaths.
    pub light_subpaths: u64,
    /// Light vertices that were stored.
    pub light_vertices: u64,
    /// Roulette queries: eye vertices that asked for light vertices.
    pub queries: u64,
    /// Nodes of the vertex BVH that queries visited.
    pub nodes_visited: u64,
    /// Light vertices that were accepted.
    pub accepted: u64,
    /// Shadow rays of connections.
    pub connection_rays: u64,
    /// Those that met nothing.
    pub visible_connections: u64,
}

/// Space, bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Memory {
    /// The most physical memory that the process ever had; `None` where the system does not say.
    pub peak_rss_bytes: Option<u64>,
    /// The largest light-vertex cache of any iteration.
    pub light_cache_bytes: u64,
    /// The largest vertex BVH of any iteration.
    pub vertex_bvh_bytes: u64,
}

impl AddAssign for Counters {
    fn add_assign(&mut self, other: Self) {
        self.camera_rays += other.camera_rays;
        self.light_subpaths += other.light_subpaths;
        self.light_vertices += other.light_vertices;
        self.queries += other.queries;
        self.nodes_visited += other.nodes_visited;
        self.accepted += other.accepted;
        self.connection_rays += other.connection_rays;
        self.visible_connections += other.visible_connections;
    }
}

impl Stats {
    /// As JSON, indented, with a newline at its end.
    pub fn to_json(&self) -> String {
        // Maps with text keys and finite numbers always serialise.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}

/// The most physical memory that this process ever had, bytes; `None` where the system does not say.
pub fn peak_rss_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

/// Processor seconds of the program so far, over all threads, ended ones too; `None` where the system does not say.
pub fn processor_seconds() -> Option<f64> {
    #[cfg(unix)]
    {
        let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        Some(now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9)
    }
    #[cfg(not(unix))]
    None
}

/// The machine's memory, bytes; 4e9 where the system does not tell.
pub(super) fn machine_bytes() -> u64 {
    let told = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| {
        let line = text.lines().find_map(|l| l.strip_prefix("MemTotal:"))?;
        let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
        Some(kibibytes * 1024)
    });
    told.unwrap_or(4_000_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    fn keys(value: &Value) -> Vec<String> {
        let mut keys: Vec<_> = value.as_object().unwrap().keys().cloned().collect();
        keys.sort();
        keys
    }

    /// The names, all of them and no others.
    #[test]
    fn the_contract() {
        let json: Value = serde_json::from_str(&Stats::default().to_json()).unwrap();
        let sorted = |names: &str| {
            let mut names: Vec<String> = names.split_whitespace().map(str::to_owned).collect();
            names.sort();
            names
        };
        assert_eq!(
            keys(&json),
            sorted(
                "version scene integrator machinery biased visibility threads seed width height iterations effects seconds \
                 counters memory"
            )
        );
        assert_eq!(
            keys(&json["seconds"]),
            sorted(
                "load accel_build light_trace vertex_bvh_build eye_trace roulette visibility film render total"
            )
        );
        assert_eq!(
            keys(&json["counters"]),
            sorted(
                "camera_rays light_subpaths light_vertices queries nodes_visited accepted connection_rays \
                 visible_connections"
            )
        );
        assert_eq!(keys(&json["memory"]), sorted("peak_rss_bytes light_cache_bytes vertex_bvh_bytes"));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn peak_memory_grows_with_use() {
        let before = peak_rss_bytes().unwrap();
        assert!(before > 1 << 20);
        let size = before as usize + (64 << 20);
        let used = vec![1u8; size];
        assert!(peak_rss_bytes().unwrap() >= size as u64, "{}", used[size / 2]);
    }
}
