//! The lobes of a material, with the bounds of its textures.

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
        let black = |c: Spectrum| c.max_element() <= 0.0;
        let mut lobes = Self::default();
        match material.scattering() {
            Scattering::Diffuse { albedo, map } => lobes.diffuse = !black(*albedo * greatest(map)),
            Scattering::Mirror { reflectance } => lobes.narrow([0.0; 2], &None, widest, !black(*reflectance)),
            Scattering::Conductor { reflectance, alpha_x, alpha_y } => {
                lobes.narrow(
                    [*alpha_x, *alpha_y],
                    &material.maps().roughness,
                    widest,
                    !black(reflectance.mean()),
                );
            }
            Scattering::Dielectric { alpha_x, alpha_y, .. } => {
                lobes.narrow([*alpha_x, *alpha_y], &material.maps().roughness, widest, true);
                lobes.transmits = true;
            }
            Scattering::Coated { albedo, map, alpha_x, alpha_y, .. } => {
                lobes.narrow([*alpha_x, *alpha_y], &material.maps().roughness, widest, true);
                lobes.diffuse |= !black(*albedo * greatest(map));
            }
        }
        lobes
    }

    fn narrow(&mut self, alpha: [f64; 2], map: &Option<Texture>, widest: f64, reflects: bool) {
        if !reflects {
            return;
        }
        // Interpolated pixels take all values between the least and the greatest.
        let (low, high) = map.as_ref().map_or((1.0, 1.0), |map| {
            let (low, high) = map.bounds();
            (low.x.clamp(0.0, 1.0).powi(2), high.x.clamp(0.0, 1.0).powi(2))
        });
        let greater = alpha[0].max(alpha[1]);
        let (least, most) = (low * greater, high * greater);
        self.alpha = Some((least, most));
        self.delta = least < MIN_ALPHA;
        self.specular = least <= SMOOTH;
        self.glossy = most > SMOOTH && least <= widest;
        self.open = most >= MIN_ALPHA && least <= widest;
        self.diffuse = most > widest;
        self.anisotropic = alpha[0] != alpha[1] && most >= MIN_ALPHA;
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
