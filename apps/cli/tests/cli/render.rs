//! `radiosity render`.

use crate::{COARSE, Room};

#[test]
fn a_picture_is_the_same_by_render_and_by_bake() {
    let room = Room::new("render");
    let run = room.run(["render", "--json", "-o", "a.png"].iter().chain(&COARSE));
    assert_eq!(run.result()["width"].as_u64(), Some(48));
    let bake = ["bake", "--vertices", "-o", "b.glb", "--image", "b.png"];
    assert_eq!(room.run(bake.iter().chain(&COARSE)).code, Some(0));
    assert!(room.read("a.png") == room.read("b.png"));
    assert_eq!(room.run(["render", "-o", "a.exr"].iter().chain(&COARSE)).code, Some(0));
    assert_eq!(room.read("a.exr")[..4], [0x76, 0x2f, 0x31, 0x01]);
}

/// Things stood before a black sky, and pictures were thought to have failed.
#[test]
fn the_black_below_an_overcast_sky_is_explained() {
    let room = Room::new("horizon");
    room.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let call = ["render", "a.obj", "-o", "a.png", "--error", "50%", "--rounds", "0", "--size", "32x32"];
    for (sky, eye, is_told) in
        [("overcast:1000", "0.3,3,3", true), ("uniform:300", "0.3,3,3", false), ("overcast:1000", "0.3,-3,3", false)]
    {
        let run = room.run(call.iter().chain(&["--sky", sky, "--eye", eye, "--target", "0.3,0.3,0"]));
        assert_eq!((run.code, run.err.contains("ends at the horizon")), (Some(0), is_told), "{run:?}");
    }
}

#[test]
fn the_eye_is_put_where_it_is_asked() {
    let room = Room::new("eye");
    // The room's own camera in other words, with another angle of view, and from where it looks to.
    let fov = (2.0 * (0.0125f64 / 0.035).atan()).to_degrees().to_string();
    let (eye, target) = ("0.278,0.273,-0.8", "0.278,0.273,0");
    let views: [&[&str]; 4] = [
        &["--camera", "front"],
        &["--eye", eye, "--target", target, "--fov", &fov],
        &["--eye", eye, "--target", target, "--fov", "30"],
        &["--eye", target, "--target", eye, "--fov", &fov],
    ];
    let pictures = views.map(|view| {
        assert_eq!(room.run(["render", "-o", "a.png"].iter().chain(&COARSE).chain(view)).code, Some(0));
        room.read("a.png")
    });
    assert!(pictures[1] == pictures[0] && pictures[2] != pictures[0] && pictures[3] != pictures[0]);
}
