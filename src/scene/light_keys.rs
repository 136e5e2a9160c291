//! `[[light]]`: point, spot and directional lights, and the environment.

use super::document::{At, Node, Table};
use super::inputs::Inputs;
use super::notes::suggestion;
use crate::error::{Error, Result};
use crate::image;
use crate::light::LightSource;
use crate::math::Spectrum;
use glam::DVec3;
use std::path::Path;
use std::sync::Arc;

const TYPES: [&str; 4] = ["point", "spot", "directional", "environment"];
/// Angles of a spot light where none are given, degrees from the middle of its cone.
const OUTER: f64 = 45.0;
const INNER_SHARE: f64 = 0.8;

/// One light.
#[derive(Debug)]
pub(super) struct LightKeys {
    light: LightSource,
    /// The image of an environment.
    file: Option<(String, At)>,
}

/// Reads all lights of a file.
pub(super) fn read(lights: &Node) -> Result<Vec<LightKeys>> {
    let mut all = Vec::new();
    for node in lights.array("[[light]]")? {
        let keys = LightKeys::read(node)?;
        let is_environment = |k: &LightKeys| matches!(k.light, LightSource::Environment { .. });
        if is_environment(&keys) && all.iter().any(is_environment) {
            return Err(node.at.error("a second environment light; there is room for one"));
        }
        all.push(keys);
    }
    Ok(all)
}

impl LightKeys {
    fn read(node: &Node) -> Result<Self> {
        let table = node.table("[[light]]")?;
        let Some(kind) = table.get("type") else {
            return Err(node.at.error(format!("[[light]] needs a type: {}", TYPES.join(", "))));
        };
        let name = kind.string("light.type")?;
        let only = |keys: &[&str]| {
            let known: Vec<&str> = ["type"].iter().chain(keys).copied().collect();
            table.only(&format!("the {name} light"), &known)
        };
        let need = |key: &str| {
            table.get(key).ok_or_else(|| kind.at.error(format!("a {name} light needs the key {key}")))
        };
        let color = |node: &Node, key: &str| node.color(&format!("light.{key}"), f64::INFINITY);
        let vector = |key: &str| need(key)?.vector(&format!("light.{key}"));
        let light = match name {
            "point" => {
                only(&["position", "intensity"])?;
                LightSource::Point {
                    position: vector("position")?,
                    intensity: color(need("intensity")?, "intensity")?,
                }
            }
            "spot" => {
                only(&["position", "direction", "target", "intensity", "inner_angle", "outer_angle"])?;
                let position = vector("position")?;
                let direction = match table.get("target") {
                    Some(target) => unit(
                        target,
                        target.vector("light.target")? - position,
                        "light.target lies on light.position",
                    )?,
                    None => direction(need("direction")?)?,
                };
                let [inner, outer] = angles(table)?;
                LightSource::Spot {
                    position,
                    direction,
                    intensity: color(need("intensity")?, "intensity")?,
                    inner,
                    outer,
                }
            }
            "directional" => {
                only(&["direction", "irradiance"])?;
                LightSource::Directional {
                    direction: direction(need("direction")?)?,
                    irradiance: color(need("irradiance")?, "irradiance")?,
                }
            }
            "environment" => {
                only(&["color", "file"])?;
                let file = table
                    .get("file")
                    .map(|n| Ok((n.string("light.file")?.to_owned(), n.at.clone())))
                    .transpose()?;
                let color = match table.get("color") {
                    Some(node) => color(node, "color")?,
                    None if file.is_some() => Spectrum::ONE,
                    None => return Err(kind.at.error("an environment light needs the key color or file")),
                };
                return Ok(Self { light: LightSource::Environment { color, image: None }, file });
            }
            other => {
                let hint = suggestion(other, TYPES);
                let known = TYPES.join(", ");
                return Err(kind
                    .at
                    .error(format!("light.type is \"{other}\"; it must be one of {known}{hint}")));
            }
        };
        Ok(Self { light, file: None })
    }

    /// The light, its image read; `folder` is that of the scene file.
    pub(super) fn load(&self, folder: &Path, inputs: &mut Inputs) -> Result<LightSource> {
        let mut light = self.light.clone();
        if let (LightSource::Environment { image, .. }, Some((file, at))) = (&mut light, &self.file) {
            let path = folder.join(file);
            let fail = |why: String| at.error(format!("environment '{file}': {why}"));
            inputs.read(&path).map_err(|e| fail(e.to_string()))?;
            let read = image::read(&path).map_err(|e| match e {
                Error::Scene { message, .. } => fail(message),
                other => fail(other.to_string()),
            })?;
            if read.pixels.is_empty() {
                return Err(fail("the image has no pixels".into()));
            }
            if let Some(i) = read.pixels.iter().position(|p| !p.is_finite()) {
                return Err(fail(format!("pixel {i} is {}; it must be finite", read.pixels[i])));
            }
            *image = Some(Arc::new(read));
        }
        Ok(light)
    }
}

fn direction(node: &Node) -> Result<DVec3> {
    unit(node, node.vector("light.direction")?, "light.direction is zero")
}

fn unit(node: &Node, v: DVec3, complaint: &str) -> Result<DVec3> {
    v.try_normalize().ok_or_else(|| node.at.error(complaint))
}

/// Angles from the middle of a spot light's cone, radians: up to where it is full, and where it ends.
fn angles(table: &Table) -> Result<[f64; 2]> {
    let outer = table.get("outer_angle").map_or(Ok(OUTER), |n| n.number("light.outer_angle"))?;
    if let Some(node) = table.get("outer_angle").filter(|_| !(outer > 0.0 && outer <= 180.0)) {
        return Err(node
            .at
            .error(format!("light.outer_angle is {outer}; it must lie between 0 and 180 degrees")));
    }
    let inner =
        table.get("inner_angle").map_or(Ok(INNER_SHARE * outer), |n| n.number("light.inner_angle"))?;
    if let Some(node) = table.get("inner_angle").filter(|_| !(0.0..outer).contains(&inner)) {
        return Err(node
            .at
            .error(format!("light.inner_angle is {inner}; it must lie between 0 and outer_angle, {outer}")));
    }
    // Angles so close that their cosines are one number would leave no room for the fall.
    if inner.to_radians().cos() <= outer.to_radians().cos() {
        let at = table.get("outer_angle").map(|n| &n.at);
        let message = "light.outer_angle is too small, or too close to inner_angle";
        return Err(at.map_or_else(|| Error::Input(message.into()), |at| at.error(message)));
    }
    Ok([inner.to_radians(), outer.to_radians()])
}
