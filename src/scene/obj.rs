//! OBJ files with their materials, gathered into one mesh.

use super::inputs::Inputs;
use super::mtl::Library;
use super::mtl_rules;
use super::notes::{Notes, suggestion};
use super::obj_scan::{Face, Scan, scan};
use super::polygon::Cutter;
use super::textures::Textures;
use crate::error::{Error, Place, Result};
use crate::geometry::Mesh;
use crate::material::Material;
use glam::{DVec2, DVec3};
use std::collections::HashMap;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The mesh of all OBJ files so far, in double precision and world coordinates.
#[derive(Default)]
pub(super) struct Gathering {
    positions: Vec<DVec3>,
    /// One per position; zero where the file has none.
    normals: Vec<DVec3>,
    uvs: Vec<DVec2>,
    triangles: Vec<[u32; 3]>,
    /// Material of each triangle.
    uses: Vec<u32>,
    /// Where each triangle was written: file and line.
    origins: Vec<(u32, u32)>,
    files: Vec<PathBuf>,
    materials: Vec<Material>,
    /// Index of the material for faces without one.
    grey: Option<u32>,
    cutter: Cutter,
    any_normals: bool,
    any_uvs: bool,
}

impl Gathering {
    /// Adds an OBJ file; `place` is where it is named.
    pub(super) fn add(&mut self, path: &Path, inputs: &mut Inputs, notes: &mut Notes) -> Result<()> {
        let fail = |e: std::io::Error| Error::scene(Place::file(path), format!("cannot be read: {e}"));
        let text = inputs.read_text(path).map_err(fail)?;
        let scan = scan(path, &text, notes)?;
        drop(text);
        let libraries = libraries(path, &scan, inputs, notes)?;
        check_materials(path, &scan, &libraries, notes);

        let first_material = self.materials.len() as u32;
        let mut textures = Textures::new(inputs);
        for library in &libraries {
            for m in &library.materials {
                self.materials.push(mtl_rules::material(library, m, &mut textures, notes)?);
            }
        }

        let header: String = (0..libraries.len()).map(|i| format!("mtllib {i}\n")).collect();
        let options = tobj::LoadOptions { single_index: true, ..Default::default() };
        let (models, _) =
            tobj::load_obj_buf(&mut header.as_bytes().chain(scan.plain.as_bytes()), &options, |p| {
                names_of(p, &libraries)
            })
            .map_err(|e| Error::scene(Place::file(path), format!("cannot be read: {e}")))?;

        self.files.push(path.to_owned());
        let mut faces = scan.faces.iter();
        for tobj::Model { mesh, .. } in models {
            let material = match mesh.material_id {
                Some(id) => first_material + id as u32,
                None if mesh.indices.is_empty() => continue,
                None => self.grey(),
            };
            self.add_model(&mesh, &mut faces, material, notes)?;
        }
        if faces.next().is_some() {
            return Err(Error::Internal(format!("{}: faces were lost in reading", path.display())));
        }
        Ok(())
    }

    fn grey(&mut self) -> u32 {
        *self.grey.get_or_insert_with(|| {
            self.materials.push(mtl_rules::grey());
            self.materials.len() as u32 - 1
        })
    }

    /// Adds one model; `faces` says how its indices fall into polygons.
    fn add_model<'a>(
        &mut self,
        mesh: &tobj::Mesh,
        faces: &mut impl Iterator<Item = &'a Face>,
        material: u32,
        notes: &mut Notes,
    ) -> Result<()> {
        let base = self.positions.len();
        let count = mesh.positions.len() / 3;
        if u32::try_from(base + count).is_err() {
            return Err(Error::Memory("the OBJ files have more than 2^32 vertices".into()));
        }
        self.positions.extend(mesh.positions.chunks_exact(3).map(DVec3::from_slice));
        self.normals.extend(mesh.normals.chunks_exact(3).map(DVec3::from_slice));
        self.uvs.extend(mesh.texcoords.chunks_exact(2).map(DVec2::from_slice));
        self.any_normals |= !mesh.normals.is_empty();
        self.any_uvs |= !mesh.texcoords.is_empty();
        // The scan has seen to it that a model has either all or none.
        self.normals.resize(base + count, DVec3::ZERO);
        self.uvs.resize(base + count, DVec2::ZERO);

        let file = self.files.len() as u32 - 1;
        let mut rest = &mesh.indices[..];
        let mut corners = Vec::new();
        let mut cut = Vec::new();
        while !rest.is_empty() {
            let face = faces.next().filter(|f| f.corners as usize <= rest.len());
            let Some(face) = face else { return Err(Error::Internal("faces were added in reading".into())) };
            let polygon;
            (polygon, rest) = rest.split_at(face.corners as usize);
            corners.clear();
            corners.extend(polygon.iter().map(|&i| self.positions[base + i as usize]));
            cut.clear();
            if !self.cutter.cut(&corners, &mut cut) {
                let place = Place::line(&self.files[file as usize], face.line as usize);
                notes.add(
                    "polygon",
                    &place,
                    "the polygon crosses itself or has no area, and is cut into a fan",
                );
            }
            self.triangles.extend(cut.iter().map(|t| t.map(|i| base as u32 + polygon[i as usize])));
            self.origins.resize(self.triangles.len(), (file, face.line));
        }
        self.uses.resize(self.triangles.len(), material);
        Ok(())
    }

    /// The finished mesh, relative to the centre of its bounds, with its materials.
    pub(super) fn finish(self, notes: &mut Notes) -> (Mesh, Vec<Material>) {
        let (low, high) = self
            .positions
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)));
        let origin = if self.positions.is_empty() { DVec3::ZERO } else { low * 0.5 + high * 0.5 };
        let mut mesh = Mesh {
            origin,
            positions: self.positions.iter().map(|&p| (p - origin).as_vec3()).collect(),
            normals: Vec::new(),
            uvs: Vec::new(),
            triangles: self.triangles,
            materials: self.uses,
        };
        if self.any_normals {
            mesh.normals = self.normals.iter().map(|n| n.normalize_or_zero().as_vec3()).collect();
        }
        if self.any_uvs {
            mesh.uvs = self.uvs.iter().map(|uv| uv.as_vec2()).collect();
        }
        let places = Places { origins: &self.origins, files: &self.files };
        drop_degenerate(&mut mesh, &places, notes);
        (mesh, self.materials)
    }
}

/// Where triangles were written.
struct Places<'a> {
    origins: &'a [(u32, u32)],
    files: &'a [PathBuf],
}

impl Places<'_> {
    fn of(&self, triangle: usize) -> Place {
        let (file, line) = self.origins[triangle];
        Place::line(&self.files[file as usize], line as usize)
    }
}

/// Reads the material libraries that a file names.
fn libraries(path: &Path, scan: &Scan, inputs: &mut Inputs, notes: &mut Notes) -> Result<Vec<Library>> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut libraries: Vec<Library> = Vec::new();
    for (names, line) in &scan.libraries {
        let names = names.replace('\\', "/");
        // One name with spaces, or several names.
        let files: Vec<PathBuf> = match folder.join(&names) {
            whole if whole.is_file() => vec![whole],
            _ => names.split_whitespace().map(|name| folder.join(name)).collect(),
        };
        for file in files {
            if libraries.iter().any(|known| known.file == file) {
                continue;
            }
            let text = inputs.read_text(&file).map_err(|e| {
                let message = format!("material library '{}' cannot be read: {e}", file.display());
                Error::scene(Place::line(path, *line), message)
            })?;
            libraries.push(Library::parse(&file, &text, notes)?);
        }
    }
    Ok(libraries)
}

/// Remarks on faces without a material and on materials that no library has.
fn check_materials(path: &Path, scan: &Scan, libraries: &[Library], notes: &mut Notes) {
    let names = || libraries.iter().flat_map(|l| &l.materials).map(|m| m.values.name.as_str());
    if let Some(line) = scan.bare_face {
        notes.add("no material", &Place::line(path, line), "faces before any usemtl are made a diffuse grey");
    }
    for (name, line) in &scan.materials {
        if !names().any(|known| known == name) {
            let hint = suggestion(name, names());
            let message = format!("there is no material '{name}'; its faces are made a diffuse grey{hint}");
            notes.add("unknown material", &Place::line(path, *line), message);
        }
    }
}

/// What the OBJ parser wants of library number `path`: where each name stands in it. Of two materials of one name the
/// later wins.
fn names_of(path: &Path, libraries: &[Library]) -> tobj::MTLLoadResult {
    let index: Option<usize> = path.to_str().and_then(|s| s.parse().ok());
    let library = index.and_then(|i| libraries.get(i)).ok_or(tobj::LoadError::OpenFileFailed)?;
    let names: HashMap<_, _> =
        library.materials.iter().enumerate().map(|(i, m)| (m.values.name.clone(), i)).collect();
    Ok((library.materials.iter().map(|m| m.values.clone()).collect(), names))
}

/// Takes out triangles without area: they cannot be hit, and have no normal.
fn drop_degenerate(mesh: &mut Mesh, places: &Places<'_>, notes: &mut Notes) {
    let flat = |t: usize| {
        let n = mesh.scaled_normal(t as u32);
        // A needle so thin that its area underflows has no normal either.
        !(n.length_squared() > 0.0)
    };
    let keep: Vec<bool> = (0..mesh.triangles.len()).map(|t| !flat(t)).collect();
    let Some(first) = keep.iter().position(|&keep| !keep) else { return };
    let count = keep.iter().filter(|&&keep| !keep).count();
    let message = format!("{count} triangle(s) without area, of which this is the first, are left out");
    notes.add("degenerate", &places.of(first), message);
    let mut kept = keep.iter();
    mesh.triangles.retain(|_| kept.next() == Some(&true));
    let mut kept = keep.iter();
    mesh.materials.retain(|_| kept.next() == Some(&true));
}
