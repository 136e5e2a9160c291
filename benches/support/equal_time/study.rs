//! What is compared: recipes, and the scenes that they are run on.

use hrr::material::{Material, Scattering};
use hrr::scene::Scene;
use hrr::settings::{AutoSwitch, Integrator, LightChoice, Range, Settings, Switch};
use hrr::subpath::World;
use std::path::Path;

/// A name and what it sets.
pub struct Recipe {
    pub name: &'static str,
    pub set: fn(Settings) -> Settings,
}

/// A scene, perhaps changed.
pub struct Variant {
    pub name: String,
    pub scene: Scene,
    /// Pixels of special interest, by their index.
    pub region: Vec<usize>,
    /// Its time, over that of others.
    pub time: f64,
    /// What makes the reference; without one, errors are told from how runs differ.
    pub referee: Option<Recipe>,
}

const PCBPT: Recipe = Recipe { name: "pcbpt", set: |s| Settings { integrator: Integrator::Pcbpt, ..s } };
const PCBPT_HRR: Recipe =
    Recipe { name: "pcbpt+hrr", set: |s| Settings { integrator: Integrator::PcbptHrr, ..s } };
const PCBPT_SPHEROID: Recipe = Recipe {
    name: "pcbpt+hrr spheroid",
    set: |s| Settings { integrator: Integrator::PcbptHrr, range: Range::Spheroid, ..s },
};
/// As the slides have it: P on the axis is the same for either shape, wherever it is not 1, and samples are the same for all pixels.
const ELLIPSOID: Recipe =
    Recipe { name: "pcbpt+hrr X=4", set: |s| Settings { range: Range::Ellipsoid, ..on_the_axis(s) } };
const SPHEROID: Recipe =
    Recipe { name: "pcbpt+hrr X=4 spheroid", set: |s| Settings { range: Range::Spheroid, ..on_the_axis(s) } };
const PT: Recipe = Recipe { name: "pt", set: |s| Settings { integrator: Integrator::Pt, ..s } };
const BPT: Recipe = Recipe { name: "bpt", set: |s| Settings { integrator: Integrator::Bpt, ..s } };
const LVC: Recipe = Recipe { name: "lvc", set: |s| Settings { integrator: Integrator::Lvc, ..s } };
const LVC_HRR: Recipe = Recipe { name: "lvc+hrr", set: |s| Settings { integrator: Integrator::LvcHrr, ..s } };
/// What the others are judged by: as many light subpaths as there is time for, whatever the scene sets.
const REFEREE: Recipe =
    Recipe { name: "lvc+hrr", set: |s| Settings { integrator: Integrator::LvcHrr, light_subpaths: 0, ..s } };
/// What `auto` does, and the same without one of the additions to the plain recipe, and without any.
const ALL: Recipe = Recipe { name: "all", set: |s| s };
const UNGUIDED: Recipe = Recipe { name: "guiding off", set: |s| Settings { guiding: AutoSwitch::Off, ..s } };
const ALL_STORED: Recipe = Recipe { name: "all stored", set: |s| Settings { storing: 1.0, ..s } };
const BY_POWER: Recipe =
    Recipe { name: "lights by power", set: |s| Settings { light_choice: LightChoice::Power, ..s } };
const UNSPREAD: Recipe = Recipe { name: "adaptive off", set: |s| Settings { adaptive: Switch::Off, ..s } };
const SMALL: Recipe = Recipe { name: "small iterations", set: small };
const PLAIN: Recipe = Recipe {
    name: "plain",
    set: |s| Settings {
        guiding: AutoSwitch::Off,
        storing: 1.0,
        light_choice: LightChoice::Power,
        adaptive: Switch::Off,
        ..small(s)
    },
};

/// One iteration of the same size: eye subpaths are then the same, and what they find by chance cancels between recipes.
const PAIRED: Recipe = Recipe { name: "all", set: paired };
const PAIRED_UNGUIDED: Recipe =
    Recipe { name: "guiding off", set: |s| Settings { guiding: AutoSwitch::Off, ..paired(s) } };
const PAIRED_STORED: Recipe = Recipe { name: "all stored", set: |s| Settings { storing: 1.0, ..paired(s) } };
const PAIRED_BY_POWER: Recipe =
    Recipe { name: "lights by power", set: |s| Settings { light_choice: LightChoice::Power, ..paired(s) } };
const PAIRED_PCBPT: Recipe =
    Recipe { name: "pcbpt+hrr", set: |s| Settings { integrator: Integrator::PcbptHrr, ..paired(s) } };

/// What judges these: other connections, and none of the additions but large iterations.
const UNADDED: Recipe = Recipe {
    name: "pcbpt+hrr",
    set: |s| Settings {
        integrator: Integrator::PcbptHrr,
        guiding: AutoSwitch::Off,
        storing: 1.0,
        light_choice: LightChoice::Power,
        adaptive: Switch::Off,
        ..s
    },
};

/// The roulette's probability set by what it is on the axis alone.
fn on_the_axis(settings: Settings) -> Settings {
    let (axis_probability, expected) = (Some(4.0), 1e6);
    Settings {
        integrator: Integrator::PcbptHrr,
        axis_probability,
        expected,
        adaptive: Switch::Off,
        ..settings
    }
}

/// One iteration of 36 samples and 600 000 light subpaths, guided.
fn paired(settings: Settings) -> Settings {
    Settings {
        integrator: Integrator::LvcHrr,
        guiding: AutoSwitch::On,
        samples: 36,
        light_subpaths: 600_000,
        iterations: 1,
        time: None,
        ..settings
    }
}

/// One sample of each pixel in every iteration, and as many light subpaths as 200 x 150 pixels.
fn small(settings: Settings) -> Settings {
    Settings { samples: 1, light_subpaths: 30_000, ..settings }
}

const PCVCM: Recipe = Recipe { name: "pcvcm", set: |s| Settings { integrator: Integrator::Pcvcm, ..s } };
const PCVCM_HRR: Recipe =
    Recipe { name: "pcvcm+hrr", set: |s| Settings { integrator: Integrator::PcvcmHrr, ..s } };

/// The scenes and recipes of a study.
pub fn of(study: &str, size: [u32; 2]) -> Option<(Vec<Variant>, Vec<Recipe>)> {
    let load = |name: &str| load(name, size);
    Some(match study {
        // Caustics reflected in a mirror of roughness 1e-4.
        "mirror" => (vec![judged(load("caustic_mirror"), "mirror")], vec![PCBPT, PCBPT_HRR]),
        // Caustics reflected in brushed metal of roughness 1e-4 and 1e-2.
        "brushed" => (vec![judged(load("brushed_funnel"), "steel")], vec![PCBPT, PCBPT_HRR, PCBPT_SPHEROID]),
        // Ranges in brushed metal, by their shape.
        "ranges" => (vec![judged(load("brushed_funnel"), "steel")], vec![SPHEROID, ELLIPSOID]),
        // What the roulette costs beside merging.
        "merging" => {
            (["mirror_room", "cornell"].map(|s| variant(load(s), "mirror")).into(), vec![PCVCM, PCVCM_HRR])
        }
        // Where the roulette has little to gain, or nothing.
        "graceful" => (graceful(size), vec![LVC, LVC_HRR]),
        // The same beside probabilistic connections.
        "graceful_pc" => (graceful(size), vec![PCBPT, PCBPT_HRR]),
        // What each addition to the plain recipe gains, and that it keeps the energy.
        "additions" => {
            let judged = |s: &&str| Variant { referee: Some(UNADDED), ..variant(load(s), "mirror") };
            (
                SCENES.iter().chain(&["specular_room"]).map(judged).collect(),
                vec![ALL, UNGUIDED, ALL_STORED, BY_POWER, UNSPREAD, SMALL, PLAIN],
            )
        }
        // That guiding, storing and other connections keep the energy, by pairs of runs with the same eye subpaths.
        "energy" => {
            let scenes = SCENES.iter().chain(&["specular_room"]);
            let recipes = vec![PAIRED, PAIRED_UNGUIDED, PAIRED_STORED, PAIRED_BY_POWER, PAIRED_PCBPT];
            (scenes.map(|s| variant(load(s), "mirror")).collect(), recipes)
        }
        // How errors fall with time: in a plain room, in a scene whose caustic every recipe meets often enough for an
        // error to be told, and in one where only the roulette does.
        "convergence" => {
            let mut rough = load("caustic_mirror");
            roughen(&mut rough, "mirror", 0.05, 0.05);
            roughen(&mut rough, "brass", 0.2, 0.2);
            let scenes = [
                ("cornell", load("cornell")),
                ("rough_mirror", rough),
                ("caustic_mirror", load("caustic_mirror")),
            ];
            let times = scenes.iter().flat_map(|(name, scene)| {
                [0.125, 0.25, 0.5, 1.0].map(|time| Variant {
                    name: format!("{name} x{time}"),
                    time,
                    ..variant(scene.clone(), "mirror")
                })
            });
            (times.collect(), vec![PT, BPT, LVC, PCBPT, LVC_HRR, PCBPT_HRR])
        }
        _ => return None,
    })
}

/// The project's scenes with a rough metal to play the roulette at.
const SCENES: [&str; 7] = [
    "cornell",
    "caustic_mirror",
    "caustic_mirror_aniso",
    "glass_caustic",
    "mirror_room",
    "brushed_funnel",
    "glossy_corridor",
];

fn graceful(size: [u32; 2]) -> Vec<Variant> {
    let mut variants: Vec<Variant> = SCENES.iter().map(|name| judged(load(name, size), "mirror")).collect();
    let mut change = |name: &str, scene: &str, change: fn(&mut Scene)| {
        let mut scene = load(scene, size);
        change(&mut scene);
        let name = name.to_owned();
        variants.push(Variant { name, ..judged(scene, "") });
    };
    change("grazing_rough", "glossy_corridor", |scene| roughen(scene, "metal", 0.25, 0.25));
    change("diagonal", "caustic_mirror_aniso", |scene| {
        material(scene, "mirror").tangent_angle = std::f64::consts::FRAC_PI_4;
    });
    change("diagonal_rough", "brushed_funnel", |scene| {
        roughen(scene, "steel", 0.01, 0.25);
        material(scene, "steel").tangent_angle = std::f64::consts::FRAC_PI_4;
    });
    change("few_vertices", "caustic_mirror", |scene| scene.settings.light_subpaths = 2000);
    variants
}

fn load(name: &str, size: [u32; 2]) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name).join("scene.toml");
    let mut scene = Scene::load(&path, &[]).expect("a scene of the project");
    [scene.film.width, scene.film.height] = size;
    scene
}

fn variant(scene: Scene, material: &str) -> Variant {
    let name = scene
        .path
        .parent()
        .and_then(Path::file_name)
        .map_or_else(String::new, |n| n.to_string_lossy().into());
    Variant { name, region: pixels_of(&scene, material), scene, time: 1.0, referee: None }
}

fn judged(scene: Scene, material: &str) -> Variant {
    Variant { referee: Some(REFEREE), ..variant(scene, material) }
}

/// The pixels in whose middle a material is seen.
fn pixels_of(scene: &Scene, material: &str) -> Vec<usize> {
    let world = World::new(scene, &scene.settings).expect("a world");
    let (width, height) = (scene.film.width, scene.film.height);
    (0..width * height)
        .filter(|i| {
            let middle = glam::DVec2::new(f64::from(i % width), f64::from(i / width)) + 0.5;
            let direction = world.camera.direction(middle);
            let ray = hrr::visibility::offset::from_free_point(world.camera.position, direction);
            world.intersect(&ray, world.camera.position, direction).is_some_and(|p| {
                scene.materials[scene.mesh.materials[p.triangle as usize] as usize].name == material
            })
        })
        .map(|i| i as usize)
        .collect()
}

fn material<'a>(scene: &'a mut Scene, name: &str) -> &'a mut Material {
    scene.materials.iter_mut().find(|m| m.name == name).expect("a material of that name")
}

fn roughen(scene: &mut Scene, name: &str, x: f64, y: f64) {
    let old = material(scene, name);
    let Scattering::Conductor { reflectance, .. } = *old.scattering() else { panic!("{name} is no metal") };
    let new = Material::new(name, Scattering::Conductor { reflectance, alpha_x: x, alpha_y: y });
    *old = new;
}
