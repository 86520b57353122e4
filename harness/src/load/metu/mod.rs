//! Scenes of the METU ray tracing courses (CENG 477 and 795): XML with meshes inline or in PLY.
//!
//! Right-handed; vertices count from one; materials are taken by their position in the file, since
//! their ids may repeat; of several transformations the first named acts first. A mesh that is shown
//! more than once is stored once, and so is the unit sphere that all ellipsoids are made of; other vertices are mapped in f64 and
//! rounded once. Elements that are not known are passed over.

mod chain;
mod objects;
mod transform;
mod xml;

use std::path::Path;

use glam::DVec3;
use roxmltree::{Document, Node};

use self::objects::Objects;
use self::xml::{File, child, group};
use super::{LoadError, xz};
use crate::render::{Camera, Material, MaterialKind, PointLight, RenderScene};

/// Loads the scene at `path` and the meshes it names.
pub fn load(path: &Path) -> Result<RenderScene, LoadError> {
    let bytes = xz::read(path)?;
    let text = String::from_utf8(bytes).map_err(|e| {
        let problem = format!("not UTF-8 text at byte {}", e.utf8_error().valid_up_to());
        LoadError::new(path, None, problem)
    })?;
    parse(path, &text)
}

/// Reads the scene in `text`; meshes it names are looked for beside `path`.
pub fn parse(path: &Path, text: &str) -> Result<RenderScene, LoadError> {
    let document = Document::parse(text).map_err(|e| {
        LoadError::new(path, e.pos().row as usize, format!("not well-formed XML: {e}"))
    })?;
    let file = File(path);
    let scene = document.root_element();
    if !scene.has_tag_name("Scene") {
        return Err(file.error(scene, "expected <Scene> as the outermost element"));
    }
    let materials = materials(file, scene)?;
    let Objects { model, geometry_material, place_material } =
        objects::read(file, scene, materials.len())?;
    Ok(RenderScene {
        model,
        geometry_material,
        place_material,
        materials,
        lights: lights(file, scene)?,
        ambient: match child(scene, "Lights") {
            Some(lights) => file.vector_or_zero(lights, "AmbientLight")?,
            None => DVec3::ZERO,
        },
        cameras: cameras(file, scene)?,
        background: file.vector_or_zero(scene, "BackgroundColor")?,
        shadow_ray_epsilon: not_negative(file, scene, "ShadowRayEpsilon", 1e-3)?,
        intersection_epsilon: not_negative(file, scene, "IntersectionTestEpsilon", 1e-6)?,
        max_recursion_depth: match child(scene, "MaxRecursionDepth") {
            Some(node) => file.whole::<1>(node)?[0],
            None => 0,
        },
    })
}

fn not_negative(file: File, node: Node, name: &str, default: f64) -> Result<f64, LoadError> {
    let x = file.number_or(node, name, default)?;
    if x < 0.0 {
        return Err(file.error(child(node, name).unwrap_or(node), format!("{x}: expected >= 0")));
    }
    Ok(x)
}

fn cameras(file: File, scene: Node) -> Result<Vec<Camera>, LoadError> {
    let cameras: Result<Vec<_>, _> =
        group(scene, "Cameras", "Camera").map(|node| camera(file, node)).collect();
    match cameras {
        Ok(none) if none.is_empty() => Err(file.error(scene, "expected a <Camera> in <Cameras>")),
        other => other,
    }
}

fn camera(file: File, node: Node) -> Result<Camera, LoadError> {
    let position = file.vector(file.child(node, "Position")?)?;
    let up = file.vector(file.child(node, "Up")?)?;
    let resolution = file.whole::<2>(file.child(node, "ImageResolution")?)?;
    let distance = file.number_or(node, "NearDistance", 1.0)?;
    let gaze = match child(node, "GazePoint") {
        Some(point) => file.vector(point)? - position,
        None => file.vector(file.child(node, "Gaze")?)?,
    };
    let camera = match child(node, "NearPlane") {
        Some(plane) => {
            Camera::new(position, gaze, up, file.numbers::<4>(plane)?, distance, resolution)
        }
        None => {
            let fov_y = child(node, "FovY")
                .ok_or_else(|| file.error(node, "expected a <NearPlane> or a <FovY> in it"))?;
            let fov_y = file.number(fov_y)?;
            Camera::look_at(position, position + gaze, up, fov_y, distance, resolution)
        }
    };
    let mut camera = camera.map_err(|e| file.error(node, e.to_string()))?;
    let name = child(node, "ImageName").and_then(|n| n.text()).unwrap_or_default();
    camera.image_name = name.trim().to_owned();
    Ok(camera)
}

fn lights(file: File, scene: Node) -> Result<Vec<PointLight>, LoadError> {
    let light = |node| {
        Ok(PointLight {
            position: file.vector(file.child(node, "Position")?)?,
            intensity: file.vector(file.child(node, "Intensity")?)?,
        })
    };
    group(scene, "Lights", "PointLight").map(light).collect()
}

fn materials(file: File, scene: Node) -> Result<Vec<Material>, LoadError> {
    group(scene, "Materials", "Material").map(|node| material(file, node)).collect()
}

fn material(file: File, node: Node) -> Result<Material, LoadError> {
    let reflectance = |file: File| file.vector_or_zero(node, "MirrorReflectance");
    let index = |name| file.number(file.child(node, name)?);
    let kind = match node.attribute("type") {
        None => MaterialKind::Plain,
        Some("mirror") => MaterialKind::Mirror { reflectance: reflectance(file)? },
        Some("conductor") => MaterialKind::Conductor {
            reflectance: reflectance(file)?,
            refraction_index: index("RefractionIndex")?,
            absorption_index: index("AbsorptionIndex")?,
        },
        Some("dielectric") => MaterialKind::Dielectric {
            refraction_index: index("RefractionIndex")?,
            absorption: file.vector_or_zero(node, "AbsorptionCoefficient")?,
        },
        Some(other) => {
            let problem =
                format!("type=\"{other}\": expected mirror, conductor, dielectric or none");
            return Err(file.error(node, problem));
        }
    };
    if let MaterialKind::Dielectric { refraction_index, .. } = kind
        && refraction_index <= 0.0
    {
        return Err(file.error(node, "RefractionIndex: expected a number above zero"));
    }
    Ok(Material {
        ambient: file.vector_or_zero(node, "AmbientReflectance")?,
        diffuse: file.vector_or_zero(node, "DiffuseReflectance")?,
        specular: file.vector_or_zero(node, "SpecularReflectance")?,
        phong_exponent: file.number_or(node, "PhongExponent", 1.0)?,
        kind,
    })
}
