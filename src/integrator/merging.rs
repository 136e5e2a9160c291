//! The radius of vertex merging.

use crate::settings::Settings;
use crate::subpath::World;
use crate::visibility::offset;
use glam::DVec2;

/// Camera rays that measure the distance of what is seen, across and down.
const PROBES: u32 = 32;

/// The first iteration's radius, world units: as set, or in pixels at the median distance of what the camera sees. One
/// radius serves the whole scene, since weights must be the same functions of a path from either end.
pub(super) fn first_radius(world: &World<'_>, settings: &Settings) -> f64 {
    if settings.merge_radius > 0.0 {
        return settings.merge_radius;
    }
    let (film, camera) = (&world.scene.film, &world.camera);
    let size = DVec2::new(film.width.into(), film.height.into());
    let mut footprints: Vec<f64> = (0..PROBES * PROBES)
        .filter_map(|i| {
            let probe = DVec2::new((i % PROBES).into(), (i / PROBES).into());
            let direction = camera.direction((probe + 0.5) / f64::from(PROBES) * size);
            let ray = offset::from_free_point(camera.position, direction);
            let point = world.intersect(&ray, camera.position, direction)?;
            // The square root of the solid angle that a pixel sees, at that distance.
            Some((point.position - camera.position).length() / camera.pdf_w(direction).sqrt())
        })
        .collect();
    if footprints.is_empty() {
        return 0.0;
    }
    let middle = footprints.len() / 2;
    settings.merge_pixels * *footprints.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// An iteration's radius: the rate of [Knaus & Zwicker 2011], with which bias and noise both vanish.
pub(super) fn radius(first: f64, shrink: f64, iteration: u64) -> f64 {
    first * (iteration as f64 + 1.0).powf(0.5 * (shrink - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_radius_shrinks_as_asked() {
        assert_eq!(radius(2.0, 1.0, 99), 2.0);
        assert!((radius(2.0, 0.5, 15) - 1.0).abs() < 1e-12);
        assert!((radius(2.0, 0.0, 3) - 1.0).abs() < 1e-12);
    }
}
