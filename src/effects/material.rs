//! The lobes of a material, with the bounds of its textures.

use super::predicate::{Judge, Predicate};
use crate::bsdf::ggx::MIN_ALPHA;
use crate::material::{Material, Scattering};
use crate::math::Spectrum;
use crate::texture::Texture;

/// GGX roughness up to which a lobe is as good as smooth: nothing connects to it.
const SMOOTH: f64 = 1e-5;

/// Which lobes a material has anywhere on its surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Lobes {
    /// Diffuse, or as good as that.
    pub diffuse: bool,
    /// Glossy: narrow, but not smooth.
    pub glossy: bool,
    /// Smooth, or as good as that.
    pub specular: bool,
    /// A true delta lobe, which only its own sampling finds.
    pub delta: bool,
    /// Narrow, but for connections not a delta lobe: glossy, or smooth only as good as.
    pub open: bool,
    /// Lets light through.
    pub transmits: bool,
    /// Roughness differs by direction.
    pub anisotropic: bool,
    /// Least and greatest GGX roughness of the narrow lobe, 0 for delta lobes; `None` without such a lobe.
    pub alpha: Option<(f64, f64)>,
}

impl Lobes {
    /// The lobes of a material; `widest`: roughness beyond which a lobe counts as diffuse.
    pub fn of(material: &Material, widest: f64) -> Self {
        Self::judged(material, widest, Judge::default())
    }

    /// As [`Lobes::of`], by a judge of predicates.
    pub(super) fn judged(material: &Material, widest: f64, judge: Judge) -> Self {
        let reflects = |c: Spectrum| judge.holds(Predicate::Reflects, c.max_element() > 0.0);
        let narrow = |lobes: &mut Self, alpha: [f64; 2], reflects: bool| {
            if reflects {
                lobes.narrow(alpha, &material.maps().roughness, widest, judge);
            }
        };
        let mut lobes = Self::default();
        match material.scattering() {
            Scattering::Diffuse { albedo, map } => lobes.diffuse = reflects(*albedo * greatest(map)),
            Scattering::Mirror { reflectance } => narrow(&mut lobes, [0.0; 2], reflects(*reflectance)),
            Scattering::Conductor { reflectance, alpha_x, alpha_y } => {
                narrow(&mut lobes, [*alpha_x, *alpha_y], reflects(reflectance.mean()));
            }
            Scattering::Dielectric { alpha_x, alpha_y, .. } => narrow(&mut lobes, [*alpha_x, *alpha_y], true),
            Scattering::Coated { albedo, map, alpha_x, alpha_y, .. } => {
                narrow(&mut lobes, [*alpha_x, *alpha_y], true);
                lobes.diffuse |= reflects(*albedo * greatest(map));
            }
        }
        let glass = matches!(material.scattering(), Scattering::Dielectric { .. });
        lobes.transmits = judge.holds(Predicate::Transmits, glass);
        lobes
    }

    fn narrow(&mut self, alpha: [f64; 2], map: &Option<Texture>, widest: f64, judge: Judge) {
        // Interpolated pixels take all values between the least and the greatest.
        let (low, high) = map.as_ref().map_or((1.0, 1.0), |map| {
            let (low, high) = map.bounds();
            (low.x.clamp(0.0, 1.0).powi(2), high.x.clamp(0.0, 1.0).powi(2))
        });
        let greater = alpha[0].max(alpha[1]);
        let (least, most) = (low * greater, high * greater);
        let narrow = judge.holds(Predicate::Narrow, least <= widest);
        let open = judge.holds(Predicate::Open, most >= MIN_ALPHA);
        self.alpha = Some((least, most));
        self.delta = judge.holds(Predicate::Delta, least < MIN_ALPHA);
        self.specular = judge.holds(Predicate::Smooth, least <= SMOOTH);
        self.glossy = narrow && judge.holds(Predicate::Rough, most > SMOOTH);
        self.open = narrow && open;
        self.diffuse = judge.holds(Predicate::Broad, most > widest);
        self.anisotropic = open && judge.holds(Predicate::Anisotropic, alpha[0] != alpha[1]);
    }

    /// Whether light goes on from it at all.
    pub fn any(&self) -> bool {
        self.diffuse || self.glossy || self.specular
    }

    /// Whether light that it throws on something can gather to a caustic.
    pub fn throws(&self) -> bool {
        self.glossy || self.specular
    }

    /// Whether other vertices can be connected to it.
    pub fn receives(&self) -> bool {
        self.diffuse || self.glossy
    }

    /// As letters: D, G, S, T, A.
    pub fn letters(&self) -> String {
        let letters = [
            (self.diffuse, 'D'),
            (self.glossy, 'G'),
            (self.specular, 'S'),
            (self.transmits, 'T'),
            (self.anisotropic, 'A'),
        ];
        letters.into_iter().filter_map(|(has, letter)| has.then_some(letter)).collect()
    }
}

fn greatest(map: &Option<Texture>) -> Spectrum {
    map.as_ref().map_or(Spectrum::ONE, |map| map.bounds().1)
}
