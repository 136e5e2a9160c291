//! Scenes and renders through the C interface: the image that Rust makes, told of and ended on the way.

use super::support::*;
use hrr::ffi::*;
use hrr::render::{Silent, render};
use hrr::scene::Scene;
use std::ffi::{CStr, CString, c_char, c_void};
use std::ptr::{null, null_mut};
use std::sync::atomic::{AtomicU32, Ordering};

const CORNELL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell/scene.toml");

/// Settings as a host has them.
struct Given(Vec<(CString, CString)>);

impl Given {
    fn new(settings: &[(&str, &str)]) -> Self {
        let text = |t: &str| CString::new(t).unwrap();
        Self(settings.iter().map(|(name, value)| (text(name), text(value))).collect())
    }

    fn raw(&self) -> Vec<HrrSetting> {
        self.0.iter().map(|(name, value)| HrrSetting { name: name.as_ptr(), value: value.as_ptr() }).collect()
    }
}

fn load(context: &Context, path: &str, settings: &[(&str, &str)]) -> Result<*mut HrrScene, HrrStatus> {
    let (path, given, mut scene) = (CString::new(path).unwrap(), Given::new(settings), null_mut());
    let raw = given.raw();
    // SAFETY: texts, an array of the size given, a local.
    match unsafe { hrr_scene_load(context.0, path.as_ptr(), raw.as_ptr(), raw.len() as u32, &mut scene) } {
        HRR_OK => Ok(scene),
        status => Err(status),
    }
}

const SMALL: [(&str, &str); 2] = [("film.width", "40"), ("film.height", "30")];

unsafe extern "C" fn stop_at_once(user: *mut c_void, done: f64) -> i32 {
    assert!((0.0..=1.0).contains(&done));
    // SAFETY: the test's counter.
    unsafe { &*user.cast_const().cast::<AtomicU32>() }.fetch_add(1, Ordering::Relaxed);
    1
}

fn info(render: *const HrrRender) -> HrrRenderInfo {
    let mut info: HrrRenderInfo = zeroed();
    info.struct_size = size_of::<HrrRenderInfo>() as u32;
    // SAFETY: live, and a local.
    assert_eq!(unsafe { hrr_render_info(render, &mut info) }, HRR_OK);
    info
}

#[test]
fn renders_are_those_of_the_rust_interface() {
    let context = Context::new(2);
    let scene = load(&context, CORNELL, &SMALL).unwrap();
    let mut about: HrrSceneInfo = zeroed();
    about.struct_size = size_of::<HrrSceneInfo>() as u32;
    let visibility = if cfg!(feature = "embree") { "embree" } else { "obvhs" };
    let set = [("integrator", "bpt"), ("iterations", "2"), ("visibility", visibility)];
    let given = Given::new(&set);
    let raw = given.raw();
    let mut desc: HrrRenderDesc = zeroed();
    desc.struct_size = size_of::<HrrRenderDesc>() as u32;
    (desc.settings, desc.setting_count) = (raw.as_ptr(), 3);
    let mut done = null_mut();
    let mut pixels = vec![0.0f32; 40 * 30 * 3];
    // SAFETY: all are live or locals of the sizes given.
    unsafe {
        assert_eq!(hrr_scene_info(scene, &mut about), HRR_OK);
        assert_eq!(hrr_render(context.0, scene, &desc, &mut done), HRR_OK, "{}", last_error());
        let (short, to) = (pixels.len() as u64 - 1, pixels.as_mut_ptr());
        assert_eq!(hrr_render_pixels(done, to, short), HRR_ERROR_BUFFER_TOO_SMALL);
        assert_eq!(hrr_render_pixels(done, to, short + 1), HRR_OK);
    }
    let overrides: Vec<_> = SMALL.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect();
    let own = Scene::load(CORNELL.as_ref(), &overrides).unwrap();
    let mut settings = own.settings.clone();
    set.iter().for_each(|(name, value)| settings.set(name, value).unwrap());
    let image = render(&own, &settings, &Silent).unwrap().film.image();
    assert!(image.pixels.iter().flat_map(|p| p.to_array()).eq(pixels.iter().copied()));
    assert!(pixels.iter().sum::<f32>() > 10.0);
    assert_eq!((about.width, about.height, about.hash), (40, 30, own.hash));
    assert_eq!(about.triangle_count, own.mesh.triangles.len() as u64);
    assert_eq!(about.warning_count as usize, own.warnings.len());
    let is = info(done);
    assert_eq!((is.width, is.height, is.iterations, is.interrupted), (40, 30, 2, 0));
    assert!(is.seconds > 0.0 && is.samples == 2);

    let directory = tempfile::tempdir().unwrap();
    let file = |name: &str| CString::new(directory.path().join(name).to_str().unwrap()).unwrap();
    let mut json = null();
    // SAFETY: live, texts, a local.
    unsafe {
        assert_eq!(hrr_render_write(done, file("a.exr").as_ptr()), HRR_OK, "{}", last_error());
        assert_eq!(hrr_render_write(done, file("a.png").as_ptr()), HRR_OK, "{}", last_error());
        assert_eq!(hrr_render_write(done, file("a.jpg").as_ptr()), HRR_ERROR_IO);
        assert_eq!(hrr_render_write(done, file("none/a.exr").as_ptr()), HRR_ERROR_IO);
        assert_eq!(hrr_render_stats(done, &mut json), HRR_OK);
        let json = CStr::from_ptr(json).to_str().unwrap();
        assert!(json.contains("\"iterations\": 2"), "{json}");
    }
    assert_eq!(hrr::image::read(&directory.path().join("a.exr")).unwrap(), image);

    // Ended at once: nothing is in the image, and the call succeeds all the same.
    let calls = AtomicU32::new(0);
    desc.progress = Some(stop_at_once);
    desc.progress_user = (&raw const calls).cast_mut().cast();
    let mut ended = null_mut();
    // SAFETY: as above; every handle once.
    unsafe {
        assert_eq!(hrr_render(context.0, scene, &desc, &mut ended), HRR_OK, "{}", last_error());
        let is = info(ended);
        assert!(is.interrupted == 1 && is.iterations < 2, "{is:?}");
        assert!(calls.load(Ordering::Relaxed) >= 2);
        hrr_scene_retain(scene);
        hrr_scene_release(scene);
        hrr_scene_release(scene);
        hrr_render_retain(ended);
        hrr_render_release(ended);
        hrr_render_release(ended);
        hrr_render_release(done);
    }
}

/// Asserts a status and a word of the message.
fn fails(status: HrrStatus, expected: HrrStatus, word: &str) {
    assert_eq!(status, expected, "{}", last_error());
    assert!(last_error().contains(word), "{:?} does not name {word:?}", last_error());
}

#[test]
fn scenes_and_settings_that_are_wrong_are_refused() {
    let context = Context::new(1);
    let bad = HRR_ERROR_INVALID_ARGUMENT;
    let refuse = |path: &str, settings: &[(&str, &str)]| load(&context, path, settings).unwrap_err();
    fails(refuse("none.toml", &[]), HRR_ERROR_IO, "none.toml");
    fails(refuse("scene.blend", &[]), HRR_ERROR_IO, "scene.blend");
    fails(refuse(CORNELL, &[("film.breadth", "40")]), bad, "breadth");
    fails(refuse(CORNELL, &[("film.width", "-3")]), bad, "film.width");
    let scene = load(&context, CORNELL, &SMALL).unwrap();
    let render = |set: &[(&str, &str)]| {
        let given = Given::new(set);
        let (raw, mut desc) = (given.raw(), zeroed::<HrrRenderDesc>());
        desc.struct_size = size_of::<HrrRenderDesc>() as u32;
        (desc.settings, desc.setting_count) = (raw.as_ptr(), raw.len() as u32);
        let mut done = null_mut();
        // SAFETY: live, or locals.
        let status = unsafe { hrr_render(context.0, scene, &desc, &mut done) };
        assert!(done.is_null());
        status
    };
    fails(render(&[("integrater", "pt")]), bad, "integrater");
    fails(render(&[("iterations", "many")]), bad, "iterations");
    let (path, mut out) = (CString::new(CORNELL).unwrap(), null_mut());
    let (p, mut done, mut text) = (path.as_ptr(), null_mut(), null::<c_char>());
    let half = [HrrSetting { name: p, value: null() }];
    let mut about: HrrSceneInfo = zeroed();
    let mut is: HrrRenderInfo = zeroed();
    // SAFETY: refused before anything is read or written; live handles, each given up once.
    unsafe {
        fails(hrr_scene_load(null(), p, null(), 0, &mut out), bad, "context");
        fails(hrr_scene_load(context.0, null(), null(), 0, &mut out), bad, "path");
        fails(hrr_scene_load(context.0, p, null(), 1, &mut out), bad, "settings");
        fails(hrr_scene_load(context.0, p, half.as_ptr(), 1, &mut out), bad, "settings[0].value");
        fails(hrr_scene_load(context.0, p, null(), 0, null_mut()), bad, "out_scene");
        fails(hrr_scene_info(null(), &mut about), bad, "scene");
        fails(hrr_scene_info(scene, null_mut()), bad, "info");
        fails(hrr_scene_info(scene, &mut about), HRR_ERROR_ABI, "struct_size");
        fails(hrr_scene_warning(null(), 0, &mut text), bad, "scene");
        fails(hrr_scene_warning(scene, 99, &mut text), bad, "index");
        fails(hrr_scene_warning(scene, 0, null_mut()), bad, "out_text");
        fails(hrr_render(null(), scene, null(), &mut done), bad, "context");
        fails(hrr_render(context.0, null(), null(), &mut done), bad, "scene");
        fails(hrr_render(context.0, scene, null(), null_mut()), bad, "out_render");
        fails(hrr_render_info(null(), &mut is), bad, "render");
        fails(hrr_render_pixels(null(), [0.0f32].as_mut_ptr(), 1), bad, "render");
        fails(hrr_render_write(null(), p), bad, "render");
        fails(hrr_render_stats(null(), &mut text), bad, "render");
        hrr_scene_retain(null_mut());
        hrr_scene_release(null_mut());
        hrr_render_retain(null_mut());
        hrr_render_release(null_mut());
        hrr_scene_release(scene);
    }
}
