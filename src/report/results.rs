//! The measurements of a study as rows, and `results.csv`, which holds all of them.

use crate::error::{Error, Place, Result};
use std::fmt::Write;
use std::path::Path;

/// Stages of a render whose seconds are told apart, summed over threads.
pub const STAGES: [&str; 5] = ["light trace", "vertex BVH", "eye trace", "roulette", "visibility"];

/// One run of one setting up to one rung of its ladder.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The setting's name.
    pub setting: String,
    /// Whether it blurs (vertex merging): its error does not fall as noise does.
    pub biased: bool,
    /// Number of the run.
    pub run: usize,
    /// Number of the rung; each takes about twice as long as the one before.
    pub rung: u32,
    /// Iterations so far.
    pub iterations: u64,
    /// Wall-clock seconds so far, pre-passes included.
    pub seconds: f64,
    /// Seconds of the pre-passes.
    pub setup: f64,
    /// Processor seconds of the whole program since the run began; `None` where the system does not tell.
    pub cpu: Option<f64>,
    /// The square of the error of [`Metrics::error`](super::metric::Metrics::error), the reference's own taken off; for
    /// small ones, chance may make it negative.
    pub square: f64,
    /// The same with all pixels counted, the worst thousandth too.
    pub whole: f64,
    /// Mean of LDR-FLIP against the reference, 0..=1: what a person would see of the error.
    pub flip: f64,
    /// Pixels brighter than ten times what they and their tile should be.
    pub fireflies: u64,
    /// Seconds of each of [`STAGES`].
    pub stages: [f64; 5],
}

/// A study: what it was made with, and its rows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Results {
    /// Names and values: scene, machine, versions, command line, ...
    pub about: Vec<(String, String)>,
    /// The rows, by setting, run and rung.
    pub rows: Vec<Row>,
}

const HEADER: &str = "setting,biased,run,rung,iterations,seconds,setup_seconds,cpu_seconds,square_error,whole_square_error,flip,fireflies,light_trace_s,vertex_bvh_s,eye_trace_s,roulette_s,visibility_s";

impl Results {
    /// As text: `# name: value` lines, a header, a line for each row. Numbers come back to the last bit.
    pub fn to_csv(&self) -> String {
        let mut text = String::new();
        for (name, value) in &self.about {
            let _ = writeln!(text, "# {name}: {}", value.replace('\n', " "));
        }
        let _ = writeln!(text, "{HEADER}");
        for r in &self.rows {
            let stages = r.stages.map(|s| s.to_string()).join(",");
            let _ = writeln!(
                text,
                "{},{},{},{},{},{},{},{},{},{},{},{},{stages}",
                r.setting,
                u8::from(r.biased),
                r.run,
                r.rung,
                r.iterations,
                r.seconds,
                r.setup,
                r.cpu.map_or(String::new(), |s| s.to_string()),
                r.square,
                r.whole,
                r.flip,
                r.fireflies
            );
        }
        text
    }

    /// Reads what [`Results::to_csv`] wrote.
    ///
    /// # Errors
    /// [`Error::Scene`] with file and line for what is missing or is no number.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path)
            .map_err(|e| Error::scene(Place::file(path), format!("cannot be read: {e}")))?;
        let mut results = Self::default();
        let mut header = false;
        for (i, line) in text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty()) {
            let fault = |message: &str| Error::scene(Place::line(path, i + 1), message);
            if let Some((name, value)) = line.strip_prefix("# ").and_then(|l| l.split_once(": ")) {
                results.about.push((name.to_owned(), value.to_owned()));
            } else if !header {
                if line != HEADER {
                    return Err(fault("is not the header of a study's results"));
                }
                header = true;
            } else {
                results.rows.push(row(line).ok_or_else(|| fault("is not a row of a study's results"))?);
            }
        }
        if results.rows.is_empty() {
            return Err(Error::scene(Place::file(path), "has no results"));
        }
        Ok(results)
    }

    /// The settings' names, in the order of their first rows.
    pub fn settings(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for row in &self.rows {
            if !names.contains(&row.setting.as_str()) {
                names.push(&row.setting);
            }
        }
        names
    }
}

fn row(line: &str) -> Option<Row> {
    let words: Vec<&str> = line.split(',').collect();
    let number = |i: usize| words.get(i)?.parse::<f64>().ok().filter(|x| x.is_finite());
    let count = |i: usize| words.get(i)?.parse::<u64>().ok();
    Some(Row {
        setting: (words.len() == 17).then(|| words[0].to_owned())?,
        biased: count(1)? != 0,
        run: count(2)? as usize,
        rung: u32::try_from(count(3)?).ok()?,
        iterations: count(4)?,
        seconds: number(5)?,
        setup: number(6)?,
        cpu: if words.get(7)?.is_empty() { None } else { Some(number(7)?) },
        square: number(8)?,
        whole: number(9)?,
        flip: number(10)?,
        fireflies: count(11)?,
        stages: [number(12)?, number(13)?, number(14)?, number(15)?, number(16)?],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_there_and_back() {
        let row = Row {
            setting: "lvc+hrr".into(),
            biased: true,
            run: 3,
            rung: 2,
            iterations: 8,
            seconds: 0.1 + 0.2,
            setup: 1e-9,
            cpu: Some(0.7),
            square: -1.5e-7,
            whole: 2.5,
            flip: 0.125,
            fireflies: 2,
            stages: [0.1, 0.0, 3.25, 1e9, 0.3],
        };
        let results = Results {
            about: vec![("scene".into(), "a: b, c".into())],
            rows: vec![row.clone(), Row { cpu: None, ..row }],
        };
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("results.csv");
        std::fs::write(&path, results.to_csv()).unwrap();
        assert_eq!(Results::read(&path).unwrap(), results);
        std::fs::write(&path, results.to_csv().replace("0.3", "x")).unwrap();
        let error = Results::read(&path).unwrap_err().to_string();
        assert!(error.contains("results.csv:3: "), "{error}");
        std::fs::write(&path, "a,b\n").unwrap();
        assert!(Results::read(&path).is_err());
    }
}
