//! Renders of scene files.

use super::context::{HrrContext, lock};
use super::log::{HRR_LOG_INFO, HRR_LOG_WARNING, Log};
use super::pointer::{self, Out};
use super::progress::{HrrProgressFn, Progress};
use super::scene::{self, HrrScene, HrrSetting};
use super::status::{Failure, HRR_ERROR_BUFFER_TOO_SMALL, HrrStatus, guard};
use crate::image::{self, Attributes, Image};
use crate::render::{self, Observer};
use std::ffi::{CString, c_char, c_void};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// How to render. Zero it, then set struct_size and what is wanted.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HrrRenderDesc {
    /// sizeof(HrrRenderDesc).
    pub struct_size: u32,
    /// Number of settings.
    pub setting_count: u32,
    /// Settings in place of the scene's; NULL when there are none. Without "threads" a render has as many as the
    /// context's pool.
    pub settings: *const HrrSetting,
    /// Told how far the render is; NULL = nobody is. What it returns ends the render after the iteration that goes on;
    /// the call then succeeds, with the image so far.
    pub progress: HrrProgressFn,
    /// Passed to progress.
    pub progress_user: *mut c_void,
}

/// A render that is finished. Immutable. Opaque; see hrr_render.
#[derive(Debug)]
pub struct HrrRender {
    image: Image,
    attributes: Attributes,
    stats: CString,
    info: HrrRenderInfo,
}

/// What there is to know about a render. Set struct_size before the call.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HrrRenderInfo {
    /// sizeof(HrrRenderInfo).
    pub struct_size: u32,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// 1: progress ended it.
    pub interrupted: u32,
    /// Iterations that are in the image; with none it is black.
    pub iterations: u64,
    /// Eye subpaths of each pixel.
    pub samples: u64,
    /// Time that it took, in seconds, without loading.
    pub seconds: f64,
}

/// Stands between the renderer, whose threads all report, and the host, whom one at a time asks.
struct Watcher {
    progress: Mutex<Progress>,
    stop: AtomicBool,
    log: Log,
}

impl Observer for Watcher {
    fn progress(&self, progress: &render::Progress) {
        // Who comes while another asks has nothing new to say.
        let Ok(host) = self.progress.try_lock() else { return };
        if host.at(progress.done()).is_err() {
            self.stop.store(true, Ordering::Relaxed);
        }
    }

    fn should_stop(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn warn(&self, message: &str) {
        self.log.say(HRR_LOG_WARNING, || message.to_owned());
    }
}

/// Renders a scene and blocks until that is done; makes a render with one reference, which hrr_render_release gives up.
/// desc: NULL for the scene's own settings. The image is the one that the program `hrr render` makes, to the last bit.
/// Uses threads of its own, not the pool. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT (a setting, or what the scene asks for), HRR_ERROR_ABI, HRR_ERROR_OUT_OF_MEMORY,
/// HRR_ERROR_INTERNAL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_render(
    context: *const HrrContext,
    scene: *const HrrScene,
    desc: *const HrrRenderDesc,
    out_render: *mut *mut HrrRender,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let (context, scene, desc, out) = unsafe {
            let desc = (!desc.is_null()).then(|| pointer::sized(desc, "desc")).transpose()?;
            let scene = &pointer::object(scene, "scene")?.scene;
            (pointer::object(context, "context")?, scene, desc, Out::new(out_render, "out_render")?)
        };
        let mut settings = scene.settings.clone();
        settings.threads = context.pool.threads();
        if let Some(desc) = &desc {
            // SAFETY: this module's contract.
            for (name, value) in unsafe { scene::settings(desc.settings, desc.setting_count) }? {
                settings.set(&name, &value).map_err(|e| Failure::argument(e.to_string()))?;
            }
        }
        let progress = desc.map_or(Progress::NONE, |d| Progress::new(d.progress, d.progress_user));
        let watcher =
            Watcher { progress: Mutex::new(progress), stop: AtomicBool::new(false), log: context.log };
        let done = render::render(scene, &settings, &watcher)?;
        // The end is told in any case, and its answer is of no use.
        let _ = lock(&watcher.progress).at(1.0);
        let (image, stats) = (done.image(), &done.stats);
        context.log.say(HRR_LOG_INFO, || {
            format!(
                "{} iterations of {} in {:.3} s",
                stats.iterations, stats.integrator, stats.seconds.render
            )
        });
        let mut attributes = Attributes::new();
        attributes.set("samplesPerPixel", done.film.samples());
        attributes.set("renderTimeSeconds", stats.seconds.render as f32);
        attributes.set("hrr:version", stats.version.as_str());
        attributes.set("hrr:scene", stats.scene.as_str());
        attributes.set("hrr:settings", settings.to_toml());
        let info = HrrRenderInfo {
            struct_size: size_of::<HrrRenderInfo>() as u32,
            width: image.width,
            height: image.height,
            interrupted: done.interrupted.into(),
            iterations: stats.iterations,
            samples: done.film.samples(),
            seconds: stats.seconds.render,
        };
        let stats = CString::new(stats.to_json()).unwrap_or_default();
        out.write(pointer::handle(HrrRender { image, attributes, stats, info }));
        Ok(())
    })
}

/// Adds a reference; NULL is allowed. Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_render_retain(render: *mut HrrRender) {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe { pointer::retain(render) };
        Ok(())
    });
}

/// Gives up a reference; the last one frees the render. NULL is allowed. Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_render_release(render: *mut HrrRender) {
    guard(|| {
        // SAFETY: this module's contract.
        unsafe { pointer::release(render) };
        Ok(())
    });
}

/// Describes a render. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_ABI.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_render_info(render: *const HrrRender, info: *mut HrrRenderInfo) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let (render, (out, struct_size)) =
            unsafe { (pointer::object(render, "render")?, pointer::sized_out(info, "info")?) };
        out.write(HrrRenderInfo { struct_size, ..render.info });
        Ok(())
    })
}

/// Writes the image to rgb: linear red, green, blue, row by row, the top row first. capacity: floats that there is room
/// for, at least 3 width height. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_BUFFER_TOO_SMALL (nothing is written).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_render_pixels(
    render: *const HrrRender,
    rgb: *mut f32,
    capacity: u64,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let (render, out) = unsafe { (pointer::object(render, "render")?, Out::new(rgb, "rgb")?) };
        let needed = 3 * render.image.pixels.len() as u64;
        if capacity < needed {
            let message = format!("the image has {needed} floats, capacity is {capacity}");
            return Err(Failure::new(HRR_ERROR_BUFFER_TOO_SMALL, message));
        }
        for (i, x) in render.image.pixels.iter().flat_map(|p| p.to_array()).enumerate() {
            // SAFETY: there are no more than the capacity.
            unsafe { out.write_at(i, x) };
        }
        Ok(())
    })
}

/// Writes the image to a file, .exr or .png by the path (in UTF-8), whole or not at all. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_IO.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_render_write(render: *const HrrRender, path: *const c_char) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let (render, path) = unsafe { (pointer::object(render, "render")?, pointer::text(path, "path")?) };
        Ok(image::write(Path::new(path), &render.image, &render.attributes)?)
    })
}

/// What the render did and what it cost, as JSON, as `hrr render --stats` has it. The render's: valid as long as it is;
/// never freed by the host. Any thread.
///
/// Errors: HRR_ERROR_INVALID_ARGUMENT.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hrr_render_stats(
    render: *const HrrRender,
    out_json: *mut *const c_char,
) -> HrrStatus {
    guard(|| {
        // SAFETY: this module's contract.
        let (render, out) = unsafe { (pointer::object(render, "render")?, Out::new(out_json, "out_json")?) };
        out.write(render.stats.as_ptr());
        Ok(())
    })
}
