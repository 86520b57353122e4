//! The loaders: what they read, and what they say when they cannot.

use std::path::{Path, PathBuf};

use glam::DVec3;
use raykern_harness::assembly::Place;
use raykern_harness::load::{LoadError, load, metu, obj, ply};
use raykern_harness::render::{MaterialKind, RenderScene};

/// A scene around `rest`, which brings objects and may bring transformations.
fn scene_text(rest: &str) -> String {
    format!(
        "<Scene>
<Cameras><Camera id=\"1\"><Position>0 0 0</Position><Gaze>0 0 -1</Gaze><Up>0 1 0</Up>
<NearPlane>-1 1 -1 1</NearPlane><NearDistance>1</NearDistance>
<ImageResolution>8 4</ImageResolution><ImageName>a.png</ImageName></Camera></Cameras>
<Materials><Material id=\"1\"><DiffuseReflectance>1 0 0</DiffuseReflectance></Material>
<Material id=\"1\" type=\"mirror\"><MirrorReflectance>0 1 0</MirrorReflectance></Material></Materials>
<VertexData>0 0 0 <!-- a comment --> 1 0 0
0 1 0 1 1 5</VertexData>
{rest}
</Scene>"
    )
}

fn parse(rest: &str) -> Result<RenderScene, LoadError> {
    metu::parse(Path::new("folder/test.xml"), &scene_text(rest))
}

fn complaint(rest: &str) -> String {
    parse(rest).expect_err("a complaint").to_string()
}

const MESH: &str = "<Mesh id=\"1\"><Material>2</Material><Transformations>t1</Transformations><Faces>1 2 3</Faces></Mesh>";
const MOVES: &str = "<Transformations><Translation id=\"1\">10 0 0</Translation>
<Translation id=\"2\">0 5 0</Translation><Scaling id=\"1\">2 2 2</Scaling>
<Rotation id=\"1\">90 0 0 3</Rotation><Scaling id=\"2\">1 2 1</Scaling>
<Scaling id=\"3\">1 0 1</Scaling>
<Composite id=\"1\">1 0 0 7 0 1 0 8 0 0 1 9 0 0 0 1</Composite></Transformations>";

/// The second vertex, `1 0 0` in the file, of each mesh.
fn second_vertices(objects: &str) -> Vec<[f32; 3]> {
    let scene = parse(&format!("{MOVES}<Objects>{objects}</Objects>")).unwrap();
    scene
        .model
        .own
        .meshes
        .iter()
        .map(|mesh| mesh.vertices[1].map(|x| (x * 1e5).round() / 1e5))
        .collect()
}

#[test]
fn materials_go_by_position_and_geometries_keep_them() {
    let scene = parse(&format!(
        "{MOVES}<Objects><Sphere id=\"1\"><Material>1</Material><Center>4</Center>
<Radius>2</Radius></Sphere>{MESH}<Triangle id=\"1\"><Material>1</Material>
<Indices>1 2 4</Indices></Triangle></Objects>"
    ))
    .unwrap();
    assert_eq!(scene.geometry_material, [1, 0, 0]);
    assert_eq!(scene.model.own.sphere_sets, [vec![[1.0, 1.0, 5.0, 2.0]]]);
    assert_eq!(scene.model.own.meshes[1].vertices, [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 5.0]]);
    assert_eq!(scene.materials[1].kind, MaterialKind::Mirror { reflectance: DVec3::Y });
    assert_eq!(
        (scene.cameras[0].resolution, scene.cameras[0].image_name.as_str()),
        ([8, 4], "a.png")
    );
}

#[test]
fn the_transformation_named_first_acts_first() {
    let mesh = |words: &str| MESH.replace("t1", words);
    assert_eq!(second_vertices(&mesh("t1 s1")), [[22.0, 0.0, 0.0]]);
    assert_eq!(second_vertices(&mesh("s1 t1")), [[12.0, 0.0, 0.0]]);
    assert_eq!(second_vertices(&mesh("r1 t1")), [[10.0, 1.0, 0.0]]);
    assert_eq!(second_vertices(&mesh("c1")), [[8.0, 8.0, 9.0]]);
}

#[test]
fn instances_stand_on_their_base_unless_reset() {
    let instance = |id: u32, base: u32, more: &str| {
        format!(
            "<MeshInstance id=\"{id}\" baseMeshId=\"{base}\" {more}><Material>1</Material>
<Transformations>t2</Transformations></MeshInstance>"
        )
    };
    let chain = [
        instance(4, 3, ""),
        MESH.to_owned(),
        instance(2, 1, ""),
        instance(3, 2, "resetTransform=\"true\""),
        instance(5, 2, "resetTransform=\"false\""),
    ];
    let expected =
        [[1.0, 10.0, 0.0], [11.0, 0.0, 0.0], [11.0, 5.0, 0.0], [1.0, 5.0, 0.0], [11.0, 10.0, 0.0]];
    assert_eq!(second_vertices(&chain.concat()), expected);
}

/// Enough triangles to be worth an instance.
const STRIP: &str = "1 2 3 2 3 4 1 2 4 1 3 4 1 2 3 2 3 4 1 2 4 1 3 4 1 2 3 2 3 4 1 2 4 1 3 4 1 2 3 2 3 4 1 2 4 1 3 4";

#[test]
fn a_mesh_that_is_shown_twice_is_stored_once() {
    let instance = |id: u32, base: u32, words: &str, more: &str| {
        format!(
            "<MeshInstance id=\"{id}\" baseMeshId=\"{base}\" {more}><Material>1</Material>
<Transformations>{words}</Transformations></MeshInstance>"
        )
    };
    let objects = [
        MESH.replace("id=\"1\"", "id=\"7\""),
        MESH.replace("1 2 3", STRIP),
        instance(2, 1, "t2", ""),
        instance(3, 2, "s2 t2", "resetTransform=\"true\""),
        // Flat: copied.
        instance(4, 1, "s3", ""),
    ];
    let scene = parse(&format!("{MOVES}<Objects>{}</Objects>", objects.concat())).unwrap();
    let model = &scene.model;
    let counts = [model.own.triangle_count(), model.triangle_count(), model.shown_triangle_count()];
    assert_eq!((counts, model.children.len()), ([17, 33, 65], 1));
    let shifts =
        |at: [usize; 3]| model.places.iter().map(move |p| at.map(|k| p.object_to_world[k]));
    assert!(shifts([3, 7, 11]).eq([[10.0, 0.0, 0.0], [10.0, 5.0, 0.0], [0.0, 5.0, 0.0]]));
    assert!(shifts([0, 5, 10]).eq([[1.0; 3], [1.0; 3], [1.0, 2.0, 1.0]]));
    assert_eq!((scene.place_material, scene.geometry_material), (vec![1, 0, 0], vec![1, 0]));
}

#[test]
fn spheres_stay_spheres_or_become_ellipsoids() {
    let sphere = |words: &str| {
        format!(
            "{MOVES}<Objects><Sphere id=\"1\"><Material>1</Material><Center>2</Center><Radius>3</Radius>
<Transformations>{words}</Transformations></Sphere></Objects>"
        )
    };
    let scene = parse(&sphere("r1 s1 t1")).unwrap();
    let [x, y, z, radius] = scene.model.own.sphere_sets[0][0];
    assert!((x - 10.0).abs() < 1e-6 && (y - 2.0).abs() < 1e-6 && z == 0.0, "{x} {y} {z}");
    assert_eq!(radius, 6.0);
    let scene = parse(&sphere("s2 t1")).unwrap();
    assert_eq!(scene.model.own.sphere_count(), 0);
    assert_eq!(scene.model.children[0].sphere_sets, [vec![[0.0, 0.0, 0.0, 1.0]]]);
    // Around 1 0 0, of radius 3, twice as high, ten to the right.
    let map = [3.0, 0.0, 0.0, 11.0, 0.0, 6.0, 0.0, 0.0, 0.0, 0.0, 3.0, 0.0];
    assert_eq!(scene.model.places, [Place { child: 0, object_to_world: map }]);
    assert_eq!(scene.place_material, [0]);
    let text = complaint(&sphere("s3"));
    assert!(text.contains("an ellipsoid without volume"), "{text}");
}

#[test]
fn complaints_name_the_file_the_line_and_what_is_wrong() {
    let mesh =
        |from: &str, to: &str| format!("{MOVES}<Objects>{}</Objects>", MESH.replace(from, to));
    // The scene's own text is eight lines long, the transformations end on the thirteenth.
    let cases = [
        (mesh("1 2 3", "1 2 9"), ":13: <Faces>: vertex 9: expected 1 to 4"),
        (mesh("1 2 3", "1 2 0"), "vertex 0: expected 1 to 4"),
        (mesh("1 2 3", "1 2"), "2 vertex numbers: expected threes"),
        (mesh("1 2 3", "1 2\nx"), ":14: <Faces>: `x`: expected a whole number"),
        (mesh("<Material>2", "<Material>3"), "material 3: expected 1 to 2"),
        (mesh("t1", "t1 r7"), "`r7`: no such transformation is defined"),
        (mesh("<Faces>1 2 3</Faces>", ""), "<Mesh>: expected a <Faces> in it"),
        (mesh("<Faces>1 2 3</Faces>", "<Faces plyFile=\"no.ply\"/>"), "no such file"),
        (
            "<Objects><MeshInstance id=\"1\" baseMeshId=\"1\"><Material>1</Material></MeshInstance>\
             </Objects>"
                .into(),
            "the instances refer to each other in a circle",
        ),
        (
            "<Objects><MeshInstance id=\"1\" baseMeshId=\"8\"><Material>1</Material></MeshInstance>\
             </Objects>"
                .into(),
            "baseMeshId 8: no mesh has this id",
        ),
        ("<Objects>".into(), "not well-formed XML"),
    ];
    for (rest, expected) in cases {
        let text = complaint(&rest);
        assert!(text.contains("test.xml") || text.contains("no.ply"), "{text}");
        assert!(text.contains(expected), "{text}\nexpected: {expected}");
    }
}

#[test]
fn cameras_are_needed_and_checked() {
    let parse = |text: &str| metu::parse(Path::new("t.xml"), text).unwrap_err().to_string();
    assert!(parse("<Scene></Scene>").contains("expected a <Camera> in <Cameras>"));
    assert!(parse("<Other/>").contains("expected <Scene>"));
    let text = scene_text("").replace("<Up>0 1 0</Up>", "<Up>0 0 2</Up>");
    assert!(parse(&text).contains("`Up` is zero, not finite or along"));
    let text = scene_text("").replace("8 4", "0 4");
    assert!(parse(&text).contains("1 to 32768 pixels"));
    let text = scene_text("").replace("-1 1 -1 1", "-1 1 -1");
    assert!(parse(&text).contains("3 numbers: expected 4"));
}

fn read_ply(text: &str) -> Result<Vec<[u32; 3]>, String> {
    ply::parse(Path::new("m.ply"), text.as_bytes())
        .map(|mesh| mesh.indices)
        .map_err(|e| e.to_string())
}

const PLY: &str = "ply
format ascii 1.0
element vertex 4
property double x
property float y
property float z
property uchar red
element face 2
property list uchar uint vertex_index
end_header
0 0 0 9
1 0 0 9
1 1 0 9
0 1 0 9
4 0 1 2 3
3 3 2 1
";

#[test]
fn ply_polygons_are_split() {
    assert_eq!(read_ply(PLY).unwrap(), [[0, 1, 2], [0, 2, 3], [3, 2, 1]]);
}

#[test]
fn ply_strips_alternate_and_start_anew() {
    let strips = PLY
        .replace("element face 2", "element tristrips 1")
        .replace("list uchar uint vertex_index", "list int int vertex_indices")
        .replace("4 0 1 2 3\n3 3 2 1\n", "8 0 1 2 3 -1 1 2 3\n");
    assert_eq!(read_ply(&strips).unwrap(), [[0, 1, 2], [2, 1, 3], [1, 2, 3]]);
}

#[test]
fn binary_ply_is_read_in_both_byte_orders() {
    let header = |order: &str| {
        format!(
            "ply\nformat binary_{order}_endian 1.0\nelement vertex 3\nproperty float x\n\
             property float y\nproperty float z\nelement face 1\n\
             property list uchar int vertex_indices\nend_header\n"
        )
    };
    let numbers = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.5, 0.0];
    let mut little = header("little").into_bytes();
    little.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
    little.push(3);
    little.extend([0i32, 1, 2].iter().flat_map(|x| x.to_le_bytes()));
    let mut big = header("big").into_bytes();
    big.extend(numbers.iter().flat_map(|x| x.to_be_bytes()));
    big.push(3);
    big.extend([0i32, 1, 2].iter().flat_map(|x| x.to_be_bytes()));
    for bytes in [&little, &big] {
        let mesh = ply::parse(Path::new("m.ply"), bytes).unwrap();
        assert_eq!((mesh.indices, mesh.vertices[2]), (vec![[0, 1, 2]], [0.0, 2.5, 0.0]));
        // Cut anywhere, the file is refused and nothing panics.
        for end in 0..bytes.len() {
            assert!(
                ply::parse(Path::new("m.ply"), &bytes[..end])
                    .map_or(true, |m| m.indices.is_empty()),
                "cut at {end}"
            );
        }
    }
}

#[test]
fn broken_ply_files_are_refused_with_a_reason() {
    let cases = [
        (PLY.replace("3 3 2 1", "3 3 2 4"), "face 1 names vertex 4: there are 4"),
        (PLY.replace("1 1 0 9", "1 one 0 9"), ":13: not a readable PLY file"),
        (PLY.replace("property float z\n", ""), "without the scalar properties x, y and z"),
        (PLY.replace("vertex_index", "corners"), "without a list `vertex_indices`"),
        (PLY.replace("element face 2", "element face 4000000000"), "not a readable PLY file"),
        ("plx\n".into(), "not a readable PLY file"),
    ];
    for (text, expected) in cases {
        let found = read_ply(&text).unwrap_err();
        assert!(found.starts_with("m.ply") && found.contains(expected), "{found}");
    }
}

#[test]
fn obj_counts_from_one_or_backwards() {
    let read = |text: &str| {
        obj::parse(Path::new("m.obj"), text.as_bytes())
            .map(|m| m.indices)
            .map_err(|e| e.to_string())
    };
    let vertices = "# made by hand\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0\r\nv 0 1 0\nvt 0 0\n";
    let faces = format!("{vertices}f 1/1 2/1/1 3//1 4\nf -1 -2 -3 # last\nl 1 2\nf 1 2\n");
    assert_eq!(read(&faces).unwrap(), [[0, 1, 2], [0, 2, 3], [3, 2, 1]]);
    for (line, expected) in [
        ("f 1 2 5", "m.obj:7: face corner `5`: there are 4 vertices so far"),
        ("f 0 1 2", "face corner `0`"),
        ("f -5 1 2", "face corner `-5`"),
        ("f a b c", "face corner `a`: expected a vertex number"),
        ("v 1 2", "m.obj:7: vertex without z"),
        ("v 1 2 c", "vertex with z = `c`, not a number"),
    ] {
        let found = read(&format!("{vertices}{line}\n")).unwrap_err();
        assert!(found.contains(expected), "{found}");
    }
}

#[test]
fn files_that_cannot_be_loaded_are_named() {
    let text = |path: &str| load(Path::new(path)).unwrap_err().to_string();
    assert!(text("no/such.xml").starts_with("no/such.xml: no such file"));
    assert!(text("a.stl").contains("expected .xml, .ply or .obj"));
    assert!(text("a").contains("expected .xml, .ply or .obj"));
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let broken = folder.join("broken.obj.xz");
    std::fs::write(&broken, b"\xfd7zXZ\0 and then nothing of the kind").unwrap();
    assert!(load(&broken).unwrap_err().to_string().contains("broken xz data"));
    let packed = folder.join("packed.obj");
    let mut bytes = Vec::new();
    let plain = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    lzma_rs::xz_compress(&mut plain.as_slice(), &mut bytes).unwrap();
    std::fs::write(folder.join("packed.obj.xz"), bytes).unwrap();
    assert_eq!(load(&packed).unwrap().model.triangle_count(), 1);
}

#[test]
fn the_collected_models_have_their_numbers_of_triangles() {
    let Some(folder) = raykern_harness::shared_scenes::folder(None) else {
        println!("skipped: no folder of scenes (RAYKERN_SCENES)");
        return;
    };
    for (name, triangles) in [
        ("classic/stanford-bunny.obj", 69_451),
        ("classic/igea.ply", 268_686),
        ("classic/sponza_part.obj", 33_662),
        ("classic/samurai_monastry.obj.xz", 124_789),
        ("classic/japanese_maple.obj.xz", 198_396),
        ("classic/teapot_stadium.xml", 18_298),
        ("metu/grass_desert.xml", 4_923),
        ("metu/marching_dragons.xml", 871_416),
        ("metu/ellipsoids.xml", 2),
        ("metu/simple_transform.xml", 3),
        ("metu/dragon_lowres.xml", 11_969),
    ] {
        let scene = load(&folder.join(name)).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(scene.model.triangle_count(), triangles, "{name}");
    }
    let missing = load(&folder.join("metu/dragon_metal.xml")).unwrap_err().to_string();
    assert!(missing.contains("dragon_remeshed_fixed.ply: no such file"), "{missing}");
}
