//! One row for every setting.

use super::{
    AutoSwitch, Backend, EmbreeBuild, Heuristic, Integrator, Kind, LightChoice, LobePrecision, MinimumRule,
    Range, Setting, Switch,
};

const TRANSPORT: &str = "Light transport";
const BUDGET: &str = "Budget and randomness";
const MACHINE: &str = "Machine";

/// All settings. `iterations` takes `time` and `error` out of force, and these it.
pub const TABLE: &[Setting] = &[
    Setting {
        name: "integrator",
        kind: Kind::Choice {
            names: &Integrator::NAMES,
            planned: &Integrator::PLANNED,
            get: |s| s.integrator as usize,
            set: |s, i| s.integrator = Integrator::ALL[i],
        },
        default: "auto",
        value_name: "NAME",
        heading: TRANSPORT,
        help: "How light is transported",
        doc: "pt: path tracing with next-event estimation. lt: light tracing. bpt: bidirectional path tracing. \
              lvc: eye subpaths connected to uniform picks from a cache of light vertices. pcbpt: connected to a few \
              reused light subpaths, picked by what they gave nearby. vcm and pcvcm: as lvc and pcbpt, with \
              vertex merging as well, whose blur shrinks from iteration to iteration. +hrr: with hierarchical \
              Russian roulette at glossy eye vertices. auto: chosen from what the scene contains.",
    },
    Setting {
        name: "with",
        kind: Kind::Effects { get: |s| s.with, set: |s, v| s.with = v },
        default: "",
        value_name: "EFFECTS",
        heading: TRANSPORT,
        help: "Effects whose machinery runs (auto) though the scene does not call for it",
        doc: "Names with commas between them, such as sds,caustics; 'hrr effects' lists them.",
    },
    Setting {
        name: "without",
        kind: Kind::Effects { get: |s| s.without, set: |s, v| s.without = v },
        default: "",
        value_name: "EFFECTS",
        heading: TRANSPORT,
        help: "Effects that are left out",
        doc: "Names with commas between them. An image without what the scene calls for is marked as biased.",
    },
    Setting {
        name: "max_depth",
        kind: Kind::Integer {
            min: 1,
            max: 65535,
            get: |s| s.max_depth.into(),
            set: |s, v| s.max_depth = v as u32,
        },
        default: "24",
        value_name: "N",
        heading: TRANSPORT,
        help: "Longest path, in segments",
        doc: "1: only emitters seen directly; 2: direct light as well; and so on.",
    },
    Setting {
        name: "samples",
        kind: Kind::Integer {
            min: 0,
            max: 65535,
            get: |s| s.samples.into(),
            set: |s, v| s.samples = v as u32,
        },
        default: "0",
        value_name: "N",
        heading: TRANSPORT,
        help: "Eye samples per pixel in each iteration; 0: what suits",
        doc: "0: with --time, as many as the time allows, in few large iterations; else 1.",
    },
    Setting {
        name: "light_subpaths",
        kind: Kind::Integer {
            min: 0,
            max: u32::MAX as u64,
            get: |s| s.light_subpaths,
            set: |s, v| s.light_subpaths = v,
        },
        default: "0",
        value_name: "N",
        heading: TRANSPORT,
        help: "Light subpaths in each iteration; 0: what suits",
        doc: "0: with --time and the roulette (+hrr), as many as take as long as the eye samples and fit the \
              memory; else as many as eye samples.",
    },
    Setting {
        name: "connections",
        kind: Kind::Integer {
            min: 1,
            max: 65535,
            get: |s| s.connections.into(),
            set: |s, v| s.connections = v as u32,
        },
        default: "1",
        value_name: "N",
        heading: TRANSPORT,
        help: "Connections that are tried at each eye vertex where the roulette is off",
        doc: "",
    },
    Setting {
        name: "expected",
        kind: Kind::Real { min: 1e-6, max: 1e6, get: |s| Some(s.expected), set: |s, v| s.expected = v },
        default: "1.0",
        value_name: "K",
        heading: TRANSPORT,
        help: "Light vertices that the roulette (+hrr) keeps on average",
        doc: "The expected number of accepted light vertices at an eye vertex where no acceptance probability \
              reaches 1. More of them lower the noise of each iteration and make it slower.",
    },
    Setting {
        name: "axis_probability",
        kind: Kind::Real {
            min: 1e-6,
            max: 1e6,
            get: |s| s.axis_probability,
            set: |s, v| s.axis_probability = Some(v),
        },
        default: "",
        value_name: "X",
        heading: TRANSPORT,
        help: "Most that the roulette's (+hrr) probability may be on the axis of a lobe, in place of 'expected'",
        doc: "Before the minimum with 1, at the distance sqrt(A / 4 pi), A the scene's surface area. Where it \
              holds, about X N alpha^2 of N light vertices are kept at a surface of GGX roughness alpha that \
              absorbs nothing, and 2 sqrt(X) - 1 times as many as at X = 1 where X is over 1. The least of this \
              and of 'expected' counts: where 'expected' asks for more than a narrow lobe can use, this saves \
              the time; a large 'expected' leaves it to X alone. 1 to 4 keep nearly all that is useful.",
    },
    Setting {
        name: "hrr_alpha",
        kind: Kind::Real { min: 0.0, max: 1.0, get: |s| Some(s.hrr_alpha), set: |s, v| s.hrr_alpha = v },
        default: "0.1",
        value_name: "ALPHA",
        heading: TRANSPORT,
        help: "Largest GGX roughness at which the roulette is used",
        doc: "Wider lobes, seen at grazing angles above all, are served better by scattering and by next-event \
              estimation.",
    },
    Setting {
        name: "range",
        kind: Kind::Choice {
            names: &Range::NAMES,
            planned: &[],
            get: |s| s.range as usize,
            set: |s, i| s.range = Range::ALL[i],
        },
        default: "ellipsoid",
        value_name: "NAME",
        heading: TRANSPORT,
        help: "Shape of the range in which the roulette (+hrr) keeps light vertices",
        doc: "ellipsoid: as the lobe of the surface is. spheroid: round about the axis, as wide as the lobe's \
              wider side. sphere: the same in all directions. All keep about as many light vertices for a value \
              of expected; the simpler ones, for comparison, keep the wrong ones more often.",
    },
    Setting {
        name: "minimum",
        kind: Kind::Choice {
            names: &MinimumRule::NAMES,
            planned: &[],
            get: |s| s.minimum as usize,
            set: |s, i| s.minimum = MinimumRule::ALL[i],
        },
        default: "nested",
        value_name: "NAME",
        heading: TRANSPORT,
        help: "Where the roulette (+hrr) has its random numbers from, whose minimum below a node it must know",
        doc: "nested: dealt on the way down, children of a node in a stratum each. semi-stratified: the paper's \
              rule. exact: the true minimum of independent numbers. pregenerated: one number for each light \
              vertex and iteration, shared by all queries, as in stochastic light culling. The last three are \
              for comparison.",
    },
    Setting {
        name: "lobe_precision",
        kind: Kind::Choice {
            names: &LobePrecision::NAMES,
            planned: &[],
            get: |s| s.lobe_precision as usize,
            set: |s, i| s.lobe_precision = LobePrecision::ALL[i],
        },
        default: "f64",
        value_name: "NAME",
        heading: TRANSPORT,
        help: "Arithmetic in which the roulette (+hrr) computes probabilities",
        doc: "f64: double precision. rebased: the offset between the two vertices in double precision, the rest \
              in single. f32: single precision throughout. The last two are for comparison: in narrow lobes they \
              bias the image.",
    },
    Setting {
        name: "lobe_widening",
        kind: Kind::Real {
            min: 0.0,
            max: 1e3,
            get: |s| Some(s.lobe_widening),
            set: |s, v| s.lobe_widening = v,
        },
        default: "1.0",
        value_name: "FACTOR",
        heading: TRANSPORT,
        help: "How much the roulette's (+hrr) lobes are widened at grazing angles; 1: as suits, 0: not at all",
        doc: "Also for refraction near the critical angle. Costs or spares noise; never biases.",
    },
    Setting {
        name: "lobe_floor",
        kind: Kind::Real { min: 0.0, max: 1.0, get: |s| Some(s.lobe_floor), set: |s, v| s.lobe_floor = v },
        default: "0.0",
        value_name: "SHARE",
        heading: TRANSPORT,
        help: "Share of a lobe's light vertices that the roulette (+hrr) also keeps from all directions",
        doc: "A floor under the lobe for what its model misses of the surface's tails: fewer bright spots, more \
              vertices. Not at surfaces that transmit.",
    },
    Setting {
        name: "node_padding",
        kind: Kind::Real {
            min: 0.0,
            max: 1e6,
            get: |s| Some(s.node_padding),
            set: |s, v| s.node_padding = v,
        },
        default: "1.0",
        value_name: "FACTOR",
        heading: TRANSPORT,
        help: "How far the roulette (+hrr) grows the boxes that it tests, over what their roundings need",
        doc: "Below 1, light vertices may be missed, and the image biased; above, time is lost.",
    },
    Setting {
        name: "storing",
        kind: Kind::Real { min: 1e-6, max: 1.0, get: |s| Some(s.storing), set: |s, v| s.storing = v },
        default: "0.05",
        value_name: "SHARE",
        heading: TRANSPORT,
        help: "Share of light vertices that are stored (+hrr) though no glossy surface threw light on them",
        doc: "Light from lamps and diffuse surfaces is found by eye subpaths as well; leaving most of it out of \
              the cache makes room and time for caustics. 1: all are stored. Vertex merging has all of them in \
              any case.",
    },
    Setting {
        name: "emitters",
        kind: Kind::Choice {
            names: &AutoSwitch::NAMES,
            planned: &[],
            get: |s| s.emitters as usize,
            set: |s, i| s.emitters = AutoSwitch::ALL[i],
        },
        default: "auto",
        value_name: "NAME",
        heading: TRANSPORT,
        help: "Whether the roulette (+hrr) judges points of lights as well",
        doc: "For many lights, or small ones, that glossy surfaces show: next-event estimation alone seldom \
              tries the one that a lobe points at. Of the points 'expected' are kept on average. auto: where all \
              lamps of emitting triangles (those that touch are one), point and spot lights amount to at least \
              16 of equal power.",
    },
    Setting {
        name: "light_choice",
        kind: Kind::Choice {
            names: &LightChoice::NAMES,
            planned: &[],
            get: |s| s.light_choice as usize,
            set: |s, i| s.light_choice = LightChoice::ALL[i],
        },
        default: "auto",
        value_name: "NAME",
        heading: TRANSPORT,
        help: "How next-event estimation chooses among lights",
        doc: "place: among up to 16 lamps (triangles that touch are one) by about how much light each may throw \
              on the place, and by power for three tenths; among more by power. power: by power. auto: by place \
              where by power the mean square of light straight from lamps would be over twice the square of its \
              mean, were nothing in between.",
    },
    Setting {
        name: "guiding",
        kind: Kind::Choice {
            names: &AutoSwitch::NAMES,
            planned: &[],
            get: |s| s.guiding as usize,
            set: |s, i| s.guiding = AutoSwitch::ALL[i],
        },
        default: "auto",
        value_name: "NAME",
        heading: TRANSPORT,
        help: "Whether emitters send light (+hrr) where a pre-pass found it useful",
        doc: "on: towards what reaches the image by way of surfaces where the roulette plays; two directions \
              of three stay as they are without. off: by the cosine alone. auto: on, but off where the pre-pass \
              finds that the roulette has little part in the image's noise, and beside vertex merging, which wants \
              light everywhere.",
    },
    Setting {
        name: "adaptive",
        kind: Kind::Choice {
            names: &Switch::NAMES,
            planned: &[],
            get: |s| s.adaptive as usize,
            set: |s, i| s.adaptive = Switch::ALL[i],
        },
        default: "on",
        value_name: "NAME",
        heading: TRANSPORT,
        help: "Whether noisy pixels get more of the eye samples (--time without --samples)",
        doc: "on: samples, and the roulette's queries, go where earlier iterations showed that they lower the \
              relative error most, and 'expected' is lowered for larger iterations where over 8 light vertices were \
              kept beside one that was. off: to all pixels alike.",
    },
    Setting {
        name: "outlier_rejection",
        kind: Kind::Choice {
            names: &Switch::NAMES,
            planned: &[],
            get: |s| s.outlier_rejection as usize,
            set: |s, i| s.outlier_rejection = Switch::ALL[i],
        },
        default: "off",
        value_name: "NAME",
        heading: TRANSPORT,
        help: "Whether bright samples that no others confirm count for less: biased",
        doc: "on: the few largest contributions to each pixel are remembered, 48 bytes a pixel; what is over 4 times as \
              bright as the fourth largest of the pixel and its neighbours, and over a tenth of the median pixel there, \
              is cut to that. The image is biased and marked so, by less and less with time; 'hrr render' writes \
              the plain one beside it.",
    },
    Setting {
        name: "mis",
        kind: Kind::Choice {
            names: &Heuristic::NAMES,
            planned: &[],
            get: |s| s.mis as usize,
            set: |s, i| s.mis = Heuristic::ALL[i],
        },
        default: "balance",
        value_name: "NAME",
        heading: TRANSPORT,
        help: "How techniques that find the same path share its weight",
        doc: "balance: in proportion to their densities. power: to the squares of these, which leaves more to \
              the best one.",
    },
    Setting {
        name: "reused_subpaths",
        kind: Kind::Integer {
            min: 1,
            max: 1_000_000,
            get: |s| s.reused_subpaths,
            set: |s, v| s.reused_subpaths = v,
        },
        default: "100",
        value_name: "N",
        heading: TRANSPORT,
        help: "Light subpaths that probabilistic connections (pcbpt) choose from",
        doc: "Each iteration takes 4 bytes and a shadow ray for each pair of an importance record and a vertex \
              of them.",
    },
    Setting {
        name: "record_spacing",
        kind: Kind::Integer {
            min: 1,
            max: 1024,
            get: |s| s.record_spacing.into(),
            set: |s, v| s.record_spacing = v as u32,
        },
        default: "8",
        value_name: "PIXELS",
        heading: TRANSPORT,
        help: "Distance of the eye subpaths that importance records (pcbpt) are made along",
        doc: "",
    },
    Setting {
        name: "merge_radius",
        kind: Kind::Real {
            min: 0.0,
            max: 1e30,
            get: |s| Some(s.merge_radius),
            set: |s, v| s.merge_radius = v,
        },
        default: "0.0",
        value_name: "LENGTH",
        heading: TRANSPORT,
        help: "Radius of vertex merging (vcm) in the first iteration, world units; 0: by merge_pixels",
        doc: "",
    },
    Setting {
        name: "merge_pixels",
        kind: Kind::Real {
            min: 1e-3,
            max: 1e3,
            get: |s| Some(s.merge_pixels),
            set: |s, v| s.merge_pixels = v,
        },
        default: "1.0",
        value_name: "PIXELS",
        heading: TRANSPORT,
        help: "Radius of vertex merging (vcm, +sds) in the first iteration, in pixels",
        doc: "A pixel is as large as at the median distance of what the camera sees. With +sds: over the root of the \
              samples of a pixel in an iteration.",
    },
    Setting {
        name: "merge_shrink",
        kind: Kind::Real {
            min: 0.0,
            max: 1.0,
            get: |s| Some(s.merge_shrink),
            set: |s, v| s.merge_shrink = v,
        },
        default: "0.75",
        value_name: "ALPHA",
        heading: TRANSPORT,
        help: "How slowly the radius of vertex merging shrinks; 1: not at all",
        doc: "Iteration i has the first one's radius times (i + 1)^((ALPHA - 1) / 2). The image converges to the \
              right one for values under 1; with 1 it stays blurred.",
    },
    Setting {
        name: "iterations",
        kind: Kind::Integer {
            min: 1,
            max: i64::MAX as u64,
            get: |s| s.iterations,
            set: |s, v| {
                s.iterations = v;
                (s.time, s.error) = (None, None);
            },
        },
        default: "64",
        value_name: "N",
        heading: BUDGET,
        help: "Iterations to run",
        doc: "",
    },
    Setting {
        name: "time",
        kind: Kind::Real { min: 1e-3, max: 1e9, get: |s| s.time, set: |s, v| s.time = Some(v) },
        default: "",
        value_name: "SECONDS",
        heading: BUDGET,
        help: "Seconds of rendering, instead of a number of iterations",
        doc: "The iteration that is under way when the time is up is finished.",
    },
    Setting {
        name: "error",
        kind: Kind::Real { min: 1e-6, max: 1e3, get: |s| s.error, set: |s, v| s.error = Some(v) },
        default: "",
        value_name: "ERROR",
        heading: BUDGET,
        help: "Relative error to reach, instead of a number of iterations",
        doc: "Of all pixels but the worst thousandth, the root of the mean of d^2 / (t^2 + eps^2): d a pixel's \
              error, t the mean luminance of the 16 x 16 pixels around it, eps a hundredth of the image's. It is \
              told from how the iterations differ, and the render stops when it is below ERROR with 90 % \
              confidence, or when --time is up. It tells noise: neither the blur of vertex merging nor light \
              that no iteration has found yet.",
    },
    Setting {
        name: "memory",
        kind: Kind::Real { min: 0.0, max: 1e6, get: |s| Some(s.memory), set: |s, v| s.memory = v },
        default: "0.0",
        value_name: "GB",
        heading: MACHINE,
        help: "Most memory that light vertices may take, 1e9 bytes; 0: half of the machine's",
        doc: "Where the renderer chooses the size of iterations, none has more light subpaths than fit.",
    },
    Setting {
        name: "first_iteration",
        kind: Kind::Integer {
            min: 0,
            max: i64::MAX as u64,
            get: |s| s.first_iteration,
            set: |s, v| s.first_iteration = v,
        },
        default: "0",
        value_name: "N",
        heading: BUDGET,
        help: "Number of the first iteration",
        doc: "Each iteration has its own random numbers: iterations 0..4 and 4..8 add up to 0..8.",
    },
    Setting {
        name: "seed",
        kind: Kind::Integer { min: 0, max: i64::MAX as u64, get: |s| s.seed, set: |s, v| s.seed = v },
        default: "0",
        value_name: "N",
        heading: BUDGET,
        help: "Seed of all random numbers",
        doc: "",
    },
    Setting {
        name: "visibility",
        kind: Kind::Choice {
            names: &Backend::NAMES,
            planned: &[],
            get: |s| s.visibility as usize,
            set: |s, i| s.visibility = Backend::ALL[i],
        },
        default: if cfg!(feature = "embree") { "embree" } else { "obvhs" },
        value_name: "NAME",
        heading: MACHINE,
        help: "What answers ray queries",
        doc: "embree: Intel Embree. obvhs: pure Rust. brute: every triangle, for tests.",
    },
    Setting {
        name: "embree_robust",
        kind: Kind::Choice {
            names: &Switch::NAMES,
            planned: &[],
            get: |s| s.embree_robust as usize,
            set: |s, i| s.embree_robust = Switch::ALL[i],
        },
        default: "on",
        value_name: "NAME",
        heading: MACHINE,
        help: "Whether Embree lets no ray slip between two triangles that share an edge",
        doc: "off: faster, and light leaks through edges now and then.",
    },
    Setting {
        name: "embree_build",
        kind: Kind::Choice {
            names: &EmbreeBuild::NAMES,
            planned: &[],
            get: |s| s.embree_build as usize,
            set: |s, i| s.embree_build = EmbreeBuild::ALL[i],
        },
        default: "high",
        value_name: "NAME",
        heading: MACHINE,
        help: "How much time Embree takes to build its tree",
        doc: "high: the fastest rays. medium: without cutting triangles. low: the fastest build.",
    },
    Setting {
        name: "threads",
        kind: Kind::Integer {
            min: 0,
            max: 1024,
            get: |s| s.threads as u64,
            set: |s, v| s.threads = v as usize,
        },
        default: "0",
        value_name: "N",
        heading: MACHINE,
        help: "Threads; 0: all",
        doc: "The image does not depend on it.",
    },
];
