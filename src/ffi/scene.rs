//! Scene files.

use super::context::HrrContext;
use super::log::HRR_LOG_WARNING;
use super::pointer::{self, Out, Strided};
use super::status::{Failure, HrrStatus, Outcome, guard};
use crate::scene::Scene;
use std::ffi::{CString, c_char};
use std::path::Path;

/// A setting: for scenes a key of the TOML file with dots ("camera.fov_y", "material.mirror.alpha"), for renders the name
/// of a setting ("iterations", "integrator"; `hrr render --help` lists them).
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HrrSetting {
    /// The key; UTF-8.
    pub name: *const c_char,
    /// The value as a scene file or the command line has it: "30", "[1e-3, 1e-3]", "lvc+hrr".
    pub value: *const c_char,
}

/// A scene that was loaded. Immutable. Opaque; see hrr_scene_load.
#[derive(Debug)]
pub struct HrrScene {
    pub(super) scene: Scene,
    warnings: Vec<CString>,
}

/// What there is to know about a scene. Set struct_size before the call.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HrrSceneInfo {
    /// sizeof(HrrSceneInfo).
    pub struct_size: u32,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Remarks of the loader; see hrr_scene_warning.
    pub warning_count: u32,
    /// Triangles.
    pub triangle_count: u64,
    /// Fingerprint of all files and settings, the same on every machine.
    pub hash: u64,
}

/// Names and values.
pub(super) unsafe fn settings(from: *const HrrSetting, count: u32) -> Outcome<Vec<(String, String)>> {
    let text = |text, i: usize, field| {
        // SAFETY: passed on.
        unsafe { pointer::text(text, &format!("settings[{i}].{field}")) }.map(str::to_owned)
    };
    // SAFETY: passed on; `get` stays below the count.
    let all = unsafe { Strided::new(from, 0, count as usize, "settings") }?;
    (0..count as usize)
        .map(|i| {
            // SAFETY: as above.
            let setting = unsafe { all.get(i) };
            Ok((text(setting.name, i, "name")?, text(setting.value, i, "value")?))
        })
        .collect()
}

/// Loads a scene, a .toml or .obj file with what it names, with one reference, which hrr_scene_release gives up. path: in
/// UTF-8. settings: setting_count of them that take the place of the file's; NULL when there are none. Remarks are logged
/// and kept. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT (a setting; also an effect that the library does not have), HRR_ERROR_IO (with file
/// and line).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_scene_load(
    context: *const HrrContext,
    path: *const c_char,
    settings: *const HrrSetting,
    setting_count: u32,
    out_scene: *mut *mut HrrScene,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let (context, path, overrides, out) = unsafe {
            let out = Out::new(out_scene, "out_scene")?;
            let overrides = self::settings(settings, setting_count)?;
            (pointer::object(context, "context")?, pointer::text(path, "path")?, overrides, out)
        };
        let scene = Scene::load(Path::new(path), &overrides)?;
        for warning in &scene.warnings {
            context.log.say(HRR_LOG_WARNING, || warning.clone());
        }
        let text = |w: &String| CString::new(w.replace('\0', " ")).unwrap_or_default();
        let warnings = scene.warnings.iter().map(text).collect();
        out.write(pointer::handle(HrrScene { scene, warnings }));
        Ok(())
    })
}

/// Adds a reference; NULL is allowed. Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_scene_retain(scene: *mut HrrScene) {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe { pointer::retain(scene) };
        Ok(())
    });
}

/// Gives up a reference; the last one frees the scene. NULL is allowed. Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_scene_release(scene: *mut HrrScene) {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe { pointer::release(scene) };
        Ok(())
    });
}

/// Describes a scene. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_ABI.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_scene_info(scene: *const HrrScene, info: *mut HrrSceneInfo) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let (scene, (out, struct_size)) =
            unsafe { (pointer::object(scene, "scene")?, pointer::sized_out(info, "info")?) };
        let Scene { film, mesh, hash, .. } = &scene.scene;
        out.write(HrrSceneInfo {
            struct_size,
            width: film.width,
            height: film.height,
            warning_count: scene.warnings.len() as u32,
            triangle_count: mesh.triangles.len() as u64,
            hash: *hash,
        });
        Ok(())
    })
}

/// One of the loader's remarks, index below warning_count, in English. The scene's: valid as long as it is; never freed
/// by the host. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_scene_warning(
    scene: *const HrrScene,
    index: u32,
    out_text: *mut *const c_char,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let (scene, out) = unsafe { (pointer::object(scene, "scene")?, Out::new(out_text, "out_text")?) };
        let count = scene.warnings.len();
        let warning = scene.warnings.get(index as usize);
        let missing = || Failure::argument(format!("index is {index}, there are {count} warnings"));
        out.write(warning.ok_or_else(missing)?.as_ptr());
        Ok(())
    })
}
