//! `[material.NAME]`: a material that takes the place of the MTL's material of that name.

use super::document::{At, Entry, Node, Table};
use super::notes::suggestion;
use crate::bsdf::Reflectance;
use crate::error::Result;
use crate::material::{Material, Scattering};
use crate::math::Spectrum;

const TYPES: [&str; 5] = ["diffuse", "conductor", "dielectric", "mirror", "coated"];
/// Keys of materials of every type.
const COMMON: [&str; 3] = ["emission", "two_sided_emission", "opacity"];

/// The table of one name.
#[derive(Debug)]
pub(super) struct MaterialKeys {
    name: String,
    at: At,
    /// Without a `type`, only emission and opacity change.
    scattering: Option<Scattering>,
    emission: Option<Spectrum>,
    two_sided_emission: Option<bool>,
    opacity: Option<f64>,
}

impl MaterialKeys {
    pub(super) fn read(entry: &Entry) -> Result<Self> {
        let name = &entry.key;
        let table = entry.node.table(&format!("[material.{name}]"))?;
        let scattering = table.get("type").map(|kind| scattering(name, table, kind)).transpose()?;
        let needs_type = |e: &&Entry| scattering.is_none() && !COMMON.contains(&e.key.as_str());
        if let Some(e) = table.entries().iter().find(needs_type) {
            let message =
                format!("'{}' in [material.{name}] needs a type beside it: {}", e.key, TYPES.join(", "));
            let known = COMMON.into_iter().chain(["type"]);
            return Err(e.at.error(message + &suggestion(&e.key, known)));
        }
        let what = |key: &str| format!("material.{name}.{key}");
        Ok(Self {
            name: name.clone(),
            at: entry.at.clone(),
            scattering,
            emission: table.get("emission").map(|n| n.color(&what("emission"), f64::INFINITY)).transpose()?,
            two_sided_emission: table
                .get("two_sided_emission")
                .map(|n| n.boolean(&what("two_sided_emission")))
                .transpose()?,
            opacity: table.get("opacity").map(|n| share(n, &what("opacity"))).transpose()?,
        })
    }

    /// Puts this in the place of every material of its name.
    pub(super) fn apply(&self, materials: &mut [Material]) -> Result<()> {
        let mut found = false;
        for material in materials.iter_mut().filter(|m| m.name == self.name) {
            found = true;
            if let Some(scattering) = &self.scattering {
                *material = Material::new(self.name.clone(), scattering.clone());
            }
            material.emission = self.emission.unwrap_or(material.emission);
            material.opacity = self.opacity.unwrap_or(material.opacity);
            material.two_sided_emission = self.two_sided_emission.unwrap_or(material.two_sided_emission);
        }
        if found {
            return Ok(());
        }
        let hint = suggestion(&self.name, materials.iter().map(|m| m.name.as_str()));
        Err(self.at.error(format!("no MTL file has a material '{}'{hint}", self.name)))
    }
}

fn scattering(name: &str, table: &Table, kind: &Node) -> Result<Scattering> {
    let what = |key: &str| format!("material.{name}.{key}");
    let only = |keys: &[&str]| {
        let known: Vec<&str> = ["type"].iter().chain(&COMMON).chain(keys).copied().collect();
        table.only(&format!("[material.{name}]"), &known)
    };
    let need = |key: &str| {
        table.get(key).ok_or_else(|| kind.at.error(format!("[material.{name}] needs the key {key}")))
    };
    match kind.string(&what("type"))? {
        "diffuse" => {
            only(&["albedo"])?;
            Ok(Scattering::Diffuse { albedo: need("albedo")?.color(&what("albedo"), 1.0)?, map: None })
        }
        "conductor" => {
            only(&["eta", "k", "reflectance", "alpha"])?;
            let reflectance = match table.get("reflectance") {
                Some(node) => {
                    if let Some(e) = table.entries().iter().find(|e| e.key == "eta" || e.key == "k") {
                        return Err(e.at.error(format!("{} and reflectance exclude each other", e.key)));
                    }
                    Reflectance::Schlick { f0: node.color(&what("reflectance"), 1.0)? }
                }
                None => {
                    let eta = need("eta")?.color(&what("eta"), f64::INFINITY)?;
                    Reflectance::Complex { eta, k: need("k")?.color(&what("k"), f64::INFINITY)? }
                }
            };
            let [alpha_x, alpha_y] = alpha(need("alpha")?, &what("alpha"))?;
            Ok(Scattering::Conductor { reflectance, alpha_x, alpha_y })
        }
        "dielectric" => {
            only(&["ior", "alpha"])?;
            let ior = table.get("ior").map_or(Ok(1.5), |n| n.number(&what("ior")))?;
            if let Some(node) = table.get("ior").filter(|_| ior <= 0.0) {
                return Err(node.at.error(format!("{} is {ior}; it must be positive", what("ior"))));
            }
            let [alpha_x, alpha_y] = table.get("alpha").map_or(Ok([0.0; 2]), |n| alpha(n, &what("alpha")))?;
            Ok(Scattering::Dielectric { ior, alpha_x, alpha_y })
        }
        "mirror" => {
            only(&["reflectance"])?;
            let node = table.get("reflectance");
            let reflectance = node.map_or(Ok(Spectrum::ONE), |n| n.color(&what("reflectance"), 1.0))?;
            Ok(Scattering::Mirror { reflectance })
        }
        "coated" => {
            only(&["albedo", "reflectance", "alpha"])?;
            let node = table.get("reflectance");
            let f0 = node.map_or(Ok(Spectrum::splat(0.04)), |n| n.color(&what("reflectance"), 1.0))?;
            let albedo = need("albedo")?.color(&what("albedo"), 1.0)?;
            let [alpha_x, alpha_y] = table.get("alpha").map_or(Ok([0.0; 2]), |n| alpha(n, &what("alpha")))?;
            Ok(Scattering::Coated { albedo, map: None, f0, alpha_x, alpha_y })
        }
        other => {
            let hint = suggestion(other, TYPES);
            let message =
                format!("{} is \"{other}\"; it must be one of {}{hint}", what("type"), TYPES.join(", "));
            Err(kind.at.error(message))
        }
    }
}

/// A number in 0..=1.
fn share(node: &Node, what: &str) -> Result<f64> {
    let x = node.number(what)?;
    if (0.0..=1.0).contains(&x) {
        Ok(x)
    } else {
        Err(node.at.error(format!("{what} is {x}; it must lie in 0..=1")))
    }
}

/// One GGX roughness for both directions, or two; 0..=1.
fn alpha(node: &Node, what: &str) -> Result<[f64; 2]> {
    let alpha = node.number(what).map(|a| [a, a]).or_else(|_| node.numbers::<2>(what))?;
    if alpha.iter().any(|a| !(0.0..=1.0).contains(a)) {
        return Err(node.at.error(format!("{what} is {alpha:?}; roughness lies in 0..=1")));
    }
    Ok(alpha)
}
