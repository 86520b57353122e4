//! A failing ray as the text of a test.

use std::fmt::Write;

use raykern::{NONE, PrimId, QueryOptions, Ray};

use super::{Scenery, Shot};

/// A Rust test that fails as long as this ray is answered wrongly, for `harness/tests/stress.rs`.
pub fn as_test(name: &str, scenery: &Scenery, shot: &Shot) -> String {
    let mut text =
        format!("#[test]\nfn {}() {{\n    let model = Model {{\n", name.replace('-', "_"));
    text += "        meshes: vec![\n";
    for mesh in &scenery.model.meshes {
        let _ = writeln!(text, "            TriangleMesh {{");
        let vertices: Vec<_> = mesh.vertices.iter().map(|v| list(v)).collect();
        let _ = writeln!(text, "                vertices: vec![{}],", vertices.join(", "));
        let _ = writeln!(text, "                indices: vec!{:?},", mesh.indices);
        let _ = writeln!(text, "            }},");
    }
    text += "        ],\n        sphere_sets: vec![\n";
    for set in &scenery.model.sphere_sets {
        let spheres: Vec<_> = set.iter().map(|s| list(s)).collect();
        let _ = writeln!(text, "            vec![{}],", spheres.join(", "));
    }
    let Ray { origin, t_min, direction, t_max } = &shot.ray;
    let _ = write!(
        text,
        "        ],\n    }};\n    let scenery = Scenery {{ model, masks: vec!{:?} }};\n    \
         let ray = Ray::new({}, {}).with_limits({}, {});\n    \
         let options = {};\n    assert_right(&scenery, &Shot {{ ray, options }});\n}}\n",
        scenery.masks,
        list(origin),
        list(direction),
        literal(*t_min),
        literal(*t_max),
        options(&shot.options),
    );
    text
}

fn options(options: &QueryOptions) -> String {
    if *options == QueryOptions::default() {
        return "QueryOptions::default()".to_owned();
    }
    let skip = match options.skip {
        Some(PrimId { prim, geometry, instance: NONE }) => {
            format!("Some(PrimId {{ prim: {prim}, geometry: {geometry}, instance: NONE }})")
        }
        other => format!("{other:?}"),
    };
    format!(
        "QueryOptions {{ mask: {}, facing: Facing::{:?}, skip: {skip}, ..Default::default() }}",
        options.mask, options.facing
    )
}

fn list(numbers: &[f32]) -> String {
    format!("[{}]", numbers.iter().map(|x| literal(*x)).collect::<Vec<_>>().join(", "))
}

/// A Rust expression with the very bits of `x`.
fn literal(x: f32) -> String {
    match x {
        f32::INFINITY => "f32::INFINITY".to_owned(),
        f32::NEG_INFINITY => "f32::NEG_INFINITY".to_owned(),
        _ if x.is_nan() => format!("f32::from_bits({:#x})", x.to_bits()),
        // The shortest decimal that gives the same float.
        _ => format!("{x:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_give_the_same_bits() {
        for bits in [0, 1, 1 << 31, 0x7f7f_ffff, 0x3eaa_aaab, 0x80ff_1234, 0x7149_f2ca] {
            let x = f32::from_bits(bits);
            assert_eq!(literal(x).parse::<f32>().map(f32::to_bits), Ok(bits), "{x:?}");
        }
        assert_eq!(literal(f32::from_bits(0x7fc0_0001)), "f32::from_bits(0x7fc00001)");
    }
}
