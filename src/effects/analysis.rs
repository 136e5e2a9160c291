//! From a scene to verdicts.

use super::convexity::is_convex_from_outside;
use super::paths::Vertex::{self, D, G, S};
use super::predicate::{Judge, Predicate};
use super::{Effect, Effects, Finding, Lobes, PathClass, Verdict, Witness};
use crate::light::LightSource;
use crate::material::Material;
use crate::math::{Spectrum, luminance};
use crate::scene::Scene;
use crate::settings::Settings;
use crate::texture::Texture;

/// A material that triangles use.
struct Used<'a> {
    material: &'a Material,
    lobes: Lobes,
    first: u32,
}

/// What all verdicts look at.
struct Facts<'a> {
    scene: &'a Scene,
    judge: Judge,
    used: Vec<Used<'a>>,
    max_depth: u32,
    /// Lights with size: emitting surfaces and an environment.
    lights: bool,
    /// Lights without.
    delta_lights: bool,
}

/// Analyses a scene as it would be rendered with these settings.
pub fn analyze(scene: &Scene, settings: &Settings) -> Effects {
    analyze_as(scene, settings, Judge::default())
}

/// As [`analyze`], by a judge who may be wrong about a predicate; for tests of the tests.
#[doc(hidden)]
pub fn analyze_as(scene: &Scene, settings: &Settings, judge: Judge) -> Effects {
    let facts = Facts::new(scene, settings, judge);
    let classes = facts.classes();
    let mut findings = Effect::ALL.map(|effect| facts.finding(effect, &classes)).to_vec();
    findings.extend(facts.unsupported());
    Effects { findings, classes }
}

impl<'a> Facts<'a> {
    fn new(scene: &'a Scene, settings: &Settings, judge: Judge) -> Self {
        let mut first = vec![None; scene.materials.len()];
        for (triangle, &m) in (0u32..).zip(&scene.mesh.materials) {
            first[m as usize].get_or_insert(triangle);
        }
        let used: Vec<Used<'_>> = scene
            .materials
            .iter()
            .zip(first)
            .filter(|(_, first)| judge.holds(Predicate::Used, first.is_some()))
            .map(|(material, first)| Used {
                material,
                lobes: Lobes::judged(material, settings.hrr_alpha, judge),
                first: first.unwrap_or(0),
            })
            .collect();
        let gives = |light: &Spectrum| judge.holds(Predicate::LampGives, luminance(*light) > 0.0);
        let delta = |light: &LightSource| match light {
            LightSource::Point { intensity, .. } | LightSource::Spot { intensity, .. } => gives(intensity),
            LightSource::Directional { irradiance, .. } => gives(irradiance),
            LightSource::Environment { .. } => false,
        };
        let delta_lights = scene.lights.iter().any(delta);
        let mut facts =
            Self { scene, judge, used, max_depth: settings.max_depth, lights: false, delta_lights };
        facts.lights = facts.used.iter().any(|u| facts.emits(u)) || facts.sky();
        facts
    }

    fn emits(&self, u: &Used<'_>) -> bool {
        self.judge.holds(Predicate::Emits, u.material.emits())
    }

    fn two_sided(&self, u: &Used<'_>) -> bool {
        self.emits(u) && self.judge.holds(Predicate::TwoSided, u.material.two_sided_emission)
    }

    fn opaque(&self, u: &Used<'_>) -> bool {
        self.judge.holds(Predicate::Opaque, u.material.is_opaque())
    }

    fn sky(&self) -> bool {
        self.judge.holds(Predicate::Sky, environment(self.scene))
    }

    fn lit(&self) -> bool {
        self.lights || self.delta_lights
    }

    fn any(&self, has: impl Fn(&Lobes) -> bool) -> bool {
        self.used.iter().any(|u| has(&u.lobes))
    }

    /// The kinds of paths that the scene may have, up to the longest path.
    fn classes(&self) -> Vec<PathClass> {
        let (diffuse, glossy, specular) =
            (self.any(|l| l.diffuse), self.any(|l| l.open), self.any(|l| l.delta));
        let exists = |v: &Vertex| match v {
            D => diffuse,
            G => glossy,
            S => specular,
        };
        let mutual = self.interreflects();
        let candidates: [(&[Vertex], Effect); 15] = [
            (&[D], Effect::Direct),
            (&[G], Effect::Direct),
            (&[S], Effect::Specular),
            (&[D, D], Effect::Interreflection),
            (&[D, G], Effect::Sdg),
            (&[G, G], Effect::Sdg),
            (&[D, S], Effect::Specular),
            (&[S, S], Effect::Specular),
            (&[S, D], Effect::Caustics),
            (&[G, D], Effect::Caustics),
            (&[S, G], Effect::Sdg),
            (&[S, D, D], Effect::Caustics),
            (&[S, D, G], Effect::Sdg),
            (&[G, D, S], Effect::Caustics),
            (&[S, D, S], Effect::Sds),
        ];
        let mut classes = Vec::new();
        for (delta_light, there) in [(false, self.lights), (true, self.delta_lights)] {
            for (surfaces, effect) in candidates {
                // What is smooth shows no light without size: those paths carry nothing.
                let open = surfaces.iter().any(|v| *v != S);
                let seen = !delta_light || self.judge.holds(Predicate::LampSeen, open);
                let possible = surfaces.len() == 1 || mutual;
                let short =
                    self.judge.holds(Predicate::ShortEnough, (surfaces.len() as u32) < self.max_depth);
                if there && seen && possible && short && surfaces.iter().all(exists) {
                    classes.push(PathClass { delta_light, surfaces: surfaces.to_vec(), effect });
                }
            }
        }
        classes
    }

    /// Whether light may go from one surface to another.
    fn interreflects(&self) -> bool {
        let mut eyes = vec![self.scene.camera.origin];
        for light in &self.scene.lights {
            if let LightSource::Point { position, .. } | LightSource::Spot { position, .. } = light {
                eyes.push(*position);
            }
        }
        let opaque = !self.any(|l| l.transmits) && self.used.iter().all(|u| self.opaque(u));
        !(opaque && is_convex_from_outside(&self.scene.mesh, &eyes, self.judge))
    }

    fn finding(&self, effect: Effect, classes: &[PathClass]) -> Finding {
        let has = |e: Effect| classes.iter().any(|c| c.effect == e);
        let of = |wanted: bool| if wanted { Verdict::Wanted } else { Verdict::Absent };
        let lights = || if self.lit() { "" } else { "nothing gives light" };
        let reason = |verdict: Verdict, wanted: &str, absent: &str| {
            let why = match (verdict, lights()) {
                (Verdict::Absent, dark) if !dark.is_empty() => dark,
                (Verdict::Absent, _) => absent,
                _ => wanted,
            };
            (verdict, why.to_owned())
        };
        let (verdict, why) = match effect {
            Effect::Direct => {
                let verdict = of(has(effect));
                reason(
                    verdict,
                    "lights and surfaces that scatter",
                    "no diffuse or glossy surface, or max_depth is 1",
                )
            }
            Effect::Interreflection => {
                let many = classes.iter().any(|c| c.surfaces.len() > 1);
                let why = "no two surfaces see each other, or max_depth is under 3";
                reason(of(many), "surfaces that light each other", why)
            }
            Effect::LightSubpaths => {
                let read = self.reads_light_subpaths(classes);
                let verdict = match (read, self.lit()) {
                    (true, _) => Verdict::Wanted,
                    (false, true) => Verdict::Inert,
                    _ => Verdict::Absent,
                };
                reason(
                    verdict,
                    if read { "what follows reads them" } else { "eye subpaths find all there is" },
                    "",
                )
            }
            Effect::Caustics => {
                let why = "no surface throws light on a diffuse one";
                reason(of(has(effect)), "narrow lobes throw light on diffuse surfaces", why)
            }
            Effect::Sdg => {
                let why = "no glossy surface that others are seen in: the query set is empty";
                reason(of(has(effect)), "glossy surfaces show others", why)
            }
            Effect::Sds => {
                // Lights without size come last.
                match classes.iter().rfind(|c| c.effect == effect) {
                    Some(class) if class.delta_light => {
                        (Verdict::Wanted, format!("only merging finds {class}"))
                    }
                    Some(class) => (
                        Verdict::Wanted,
                        format!("but for merging, only chance that meets a light finds {class}"),
                    ),
                    None => (Verdict::Absent, "no smooth surface before and after a diffuse one".into()),
                }
            }
            Effect::Specular => (of(self.any(|l| l.specular)), "smooth lobes".into()),
            Effect::Refraction => (of(self.any(|l| l.transmits)), "light passes through surfaces".into()),
            Effect::Opacity => (
                of(self.used.iter().any(|u| !self.opaque(u))),
                "surfaces that are not everywhere there".into(),
            ),
            Effect::Textures | Effect::NormalMaps | Effect::EmissionTextures => self.maps(effect),
            Effect::Anisotropy => (of(self.any(|l| l.anisotropic)), "roughness differs by direction".into()),
            Effect::Environment => (of(self.sky()), "an environment light".into()),
            Effect::Lens => {
                let radius = self.scene.camera.aperture_radius;
                (
                    of(self.judge.holds(Predicate::Aperture, radius > 0.0)),
                    format!("camera.aperture_radius is {radius}"),
                )
            }
            Effect::TwoSidedEmission => {
                (of(self.used.iter().any(|u| self.two_sided(u))), "back faces emit".into())
            }
        };
        let plain_absent = |why: String| match effect {
            Effect::Lens => why,
            e if verdict == Verdict::Absent && e >= Effect::Specular && !why.starts_with("every") => {
                "nothing of it in the scene".into()
            }
            _ => why,
        };
        Finding {
            id: effect.id().to_owned(),
            verdict,
            why: plain_absent(why),
            materials: if verdict == Verdict::Absent { Vec::new() } else { self.witnesses(effect) },
            machinery: machinery(effect),
        }
    }

    fn reads_light_subpaths(&self, classes: &[PathClass]) -> bool {
        let reads = |c: &PathClass| matches!(c.effect, Effect::Caustics | Effect::Sdg | Effect::Sds);
        classes.iter().any(reads)
    }

    fn maps(&self, effect: Effect) -> (Verdict, String) {
        let maps: Vec<&Texture> = self.used.iter().flat_map(|u| maps_of(u.material, effect)).collect();
        let varies = |map: &&Texture| self.judge.holds(Predicate::Varies, map.constant().is_none());
        let varying = maps.iter().any(varies);
        let bends = self.judge.holds(Predicate::EvenNormals, effect == Effect::NormalMaps);
        match (varying, maps.is_empty()) {
            (true, _) => (Verdict::Wanted, "maps that vary".into()),
            // An even normal map may still bend normals; an even picture is its value, to the bit.
            (false, false) if bends => (Verdict::Wanted, "a normal map".into()),
            (false, false) => {
                (Verdict::Absent, "every map is the same everywhere: it counts as its value".into())
            }
            (false, true) => (Verdict::Absent, String::new()),
        }
    }

    /// The materials that an effect rests on.
    fn witnesses(&self, effect: Effect) -> Vec<Witness> {
        let counts = |u: &&Used<'_>| match effect {
            Effect::Direct => self.emits(u) || u.lobes.receives(),
            Effect::Interreflection => u.lobes.any(),
            Effect::LightSubpaths | Effect::Caustics => u.lobes.throws(),
            Effect::Sdg => u.lobes.open,
            Effect::Sds | Effect::Specular => u.lobes.specular,
            Effect::Refraction => u.lobes.transmits,
            Effect::Opacity => !self.opaque(u),
            Effect::Textures | Effect::NormalMaps | Effect::EmissionTextures => {
                !maps_of(u.material, effect).is_empty()
            }
            Effect::Anisotropy => u.lobes.anisotropic,
            Effect::TwoSidedEmission => self.two_sided(u),
            Effect::Environment | Effect::Lens => false,
        };
        let witness = |u: &Used<'_>| Witness {
            material: u.material.name.clone(),
            triangle: u.first,
            evidence: evidence(u, effect),
        };
        self.used.iter().filter(counts).map(witness).collect()
    }

    /// What materials ask for and hrr has not got, in the order of materials and their lines.
    fn unsupported(&self) -> Vec<Finding> {
        let mut findings: Vec<Finding> = Vec::new();
        for u in &self.used {
            for lack in &u.material.unsupported {
                let witness = Witness {
                    material: u.material.name.clone(),
                    triangle: u.first,
                    evidence: lack.place.to_string(),
                };
                match findings.iter_mut().find(|f| f.id == lack.key) {
                    Some(known) => known.materials.push(witness),
                    None => findings.push(Finding {
                        id: lack.key.to_owned(),
                        verdict: Verdict::Unsupported,
                        why: lack.what.clone(),
                        materials: vec![witness],
                        machinery: &[],
                    }),
                }
            }
        }
        findings
    }
}

fn environment(scene: &Scene) -> bool {
    let gives = |light: &LightSource| match light {
        LightSource::Environment { color, image } => {
            let lit = |image: &std::sync::Arc<crate::image::Image>| {
                image.pixels.iter().any(|p| (p.as_dvec3() * *color).max_element() > 0.0)
            };
            luminance(*color) > 0.0 && image.as_ref().is_none_or(lit)
        }
        _ => false,
    };
    scene.lights.iter().any(gives)
}

fn maps_of(material: &Material, effect: Effect) -> Vec<&Texture> {
    let maps = material.maps();
    let list = match effect {
        Effect::Textures => vec![material.scattering().albedo_map(), &maps.roughness],
        Effect::NormalMaps => vec![&maps.normal],
        Effect::EmissionTextures => vec![&maps.emission],
        _ => Vec::new(),
    };
    list.into_iter().flatten().collect()
}

fn evidence(u: &Used<'_>, effect: Effect) -> String {
    let mut parts = vec![format!("lobes {}", if u.lobes.any() { u.lobes.letters() } else { "none".into() })];
    if let Some((least, most)) = u.lobes.alpha {
        parts.push(if least == most { format!("alpha {least}") } else { format!("alpha {least} to {most}") });
    }
    for map in maps_of(u.material, effect) {
        let (low, high) = map.bounds();
        parts.push(format!("texture from {low} to {high}"));
    }
    if !u.material.is_opaque() {
        parts.push(format!("opacity {}", u.material.opacity));
    }
    if u.material.emits() {
        parts.push(format!("emits {}", u.material.emission));
    }
    parts.join(", ")
}

fn machinery(effect: Effect) -> &'static [&'static str] {
    match effect {
        Effect::Direct => &["next_event"],
        Effect::Interreflection => &["eye_subpaths"],
        Effect::LightSubpaths => &["light_subpaths"],
        Effect::Caustics => &["light_subpaths", "light_image", "connections"],
        Effect::Sdg => &["light_subpaths", "vertex_bvh", "hrr"],
        Effect::Sds => &["light_subpaths", "vertex_bvh", "merging"],
        Effect::Specular => &["delta_lobes"],
        Effect::Refraction => &["transmission"],
        Effect::Opacity => &["any_hit_filter"],
        Effect::Textures => &["texture_lookups"],
        Effect::EmissionTextures => &["emission_lookups"],
        Effect::NormalMaps => &["tangent_frames"],
        Effect::Anisotropy => &["ellipsoids"],
        Effect::Environment => &["sky_sampling"],
        Effect::Lens => &["lens_sampling"],
        Effect::TwoSidedEmission => &["two_sided_emission"],
    }
}
