//! `radiosity render`.

use crate::{COARSE, LAMP, Room};
use serde_json::Value;
use std::fs;

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
    let views: [&[&str]; 5] = [
        &["--camera", "front"],
        &["--eye", eye, "--target", target, "--fov", &fov],
        &["--eye", eye, "--target", target, "--fov", "30"],
        &["--eye", target, "--target", eye, "--fov", &fov],
        &["--fov", "30"],
    ];
    let pictures = views.map(|view| {
        assert_eq!(room.run(["render", "-o", "a.png"].iter().chain(&COARSE).chain(view)).code, Some(0));
        room.read("a.png")
    });
    assert!(pictures[1] == pictures[0] && pictures[2] != pictures[0] && pictures[3] != pictures[0]);
    // An angle of view by itself is that of the scene's own camera.
    assert!(pictures[4] == pictures[2]);
}

/// Where the program's own camera stands is told in the words that put one there.
#[test]
fn a_camera_that_is_placed_is_told() {
    let room = Room::new("placed");
    room.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let call = ["render", "a.obj", "-o", "a.png", "--error", "50%", "--rounds", "0", "--sky", "uniform:300"];
    let run = room.run(call.iter().chain(&["--size", "96x96"]));
    // Width and height in the first chunk of a PNG.
    let size = || room.read("a.png")[16..24].to_owned();
    let first = size();
    let told = run.err.lines().find_map(|line| line.split_once("for this scene is ")).expect("a note").1.to_owned();
    assert!(run.err.contains("--up z"), "{run:?}");
    let words: Vec<&str> = told.split(' ').collect();
    let ["--eye", eye, "--target", target, "--fov", fov, "--size", "96x96"] = words[..] else { panic!("{told}") };

    let scene = radiosity::io::load(&room.path("a.obj"), &Default::default()).unwrap().scene;
    let mesh = radiosity::Mesh::new(&scene);
    let camera = radiosity::place_camera(&radiosity::Tracer::new(&scene, &mesh), Some(1.0));
    let place = |text: &str| text.split(',').map(|x| x.parse::<f64>().unwrap()).collect::<Vec<_>>();
    let (eye, target) = (place(eye), place(target));
    for axis in 0..3 {
        let (at, back) = (camera.world_from_camera.w_axis[axis], camera.world_from_camera.z_axis[axis]);
        assert!((eye[axis] - at).abs() < 1e-4 && (eye[axis] - target[axis] - back).abs() < 2e-4, "{told}");
    }
    let radiosity::Projection::Perspective { vertical_fov } = camera.projection else { panic!("{camera:?}") };
    assert!((fov.parse::<f64>().unwrap() - vertical_fov.to_degrees()).abs() < 0.01, "{told}");

    let again = room.run(call.iter().chain(&words));
    assert!(!again.err.contains("for this scene is") && !again.err.contains("--up"), "{again:?}");
    assert_eq!((again.code, size()), (Some(0), first));
}

/// A parallel camera has no angle of view to change.
#[test]
fn parallel_cameras_have_no_angle() {
    let room = Room::new("parallel");
    let camera = r#"{"cameras":[{"name":"plan","type":"orthographic","orthographic":{"xmag":1,"ymag":1,"znear":0.1,"zfar":9}}],"#;
    let scene = LAMP.replacen('{', camera, 1).replace(r#""nodes":[0,1]"#, r#""nodes":[0,1,2]"#);
    room.write("a.gltf", &scene.replace(r#"{"mesh":0},"#, r#"{"mesh":0},{"camera":0,"translation":[0,1,0]},"#));
    let run = room.run(["render", "a.gltf", "-o", "a.png", "--fov", "30"]);
    assert!(run.code == Some(2) && run.err.contains("'plan' projects in parallel"), "{run:?}");
}

/// Pictures on the way are whole, small and many; the one at the end has the bytes that it has without them.
#[test]
fn catalogue_43_pictures_on_the_way_change_nothing_at_the_end() {
    let room = Room::new("frames");
    let call = |name: &'static str| [&["render", "-o", name, "--json"], &COARSE[..]].concat();
    room.run(call("plain.png")).result();
    let run = room.run([&call("shown.png")[..], &["--frames", "way"]].concat());
    run.result();
    assert!(room.read("plain.png") == room.read("shown.png"));
    let frames: Vec<Value> = run.events().into_iter().filter(|event| event["event"] == "frame").collect();
    let rays: Vec<u64> = frames.iter().filter_map(|frame| frame["rays"].as_u64()).collect();
    // Of what is seen and of all elements before any ray, then twice as many each time; then the solution itself, once it has
    // rays.
    assert!(rays.len() >= 6 && rays[..5] == [0, 0, 16, 32, 64] && rays[5..].iter().all(|&rays| rays > 0), "{rays:?}");
    let seconds: Vec<f64> = frames.iter().filter_map(|frame| frame["seconds"].as_f64()).collect();
    assert!(seconds.is_sorted(), "{seconds:?}");
    for (number, frame) in frames.iter().enumerate() {
        let name = format!("way/frame-{number:03}.png");
        let bytes = room.read(&name);
        assert_eq!(frame["output"], name.as_str());
        // Width and height in the first chunk of a PNG, and its end.
        assert_eq!(
            (&bytes[16..24], &bytes[bytes.len() - 8..bytes.len() - 4]),
            (&[0, 0, 0, 12, 0, 0, 0, 12][..], &b"IEND"[..])
        );
    }
    assert_eq!(fs::read_dir(room.0.join("way")).unwrap().count(), frames.len(), "no temporary file is left");

    let again = room.run([&call("shown.png")[..], &["--frames", "way"]].concat());
    assert!(again.code == Some(2) && again.err.contains("has frames of another run"), "{again:?}");
    let said = room.run([&["render", "-o", "a.png", "--frames", "other"], &COARSE[..]].concat());
    assert!(said.err.contains("first picture after ") && said.err.contains("frame-000.png"), "{said:?}");
}

/// Time that is over is told beside the error, and what there is by then is written.
#[test]
fn a_limit_of_time_and_nearness_on_the_display_are_told() {
    let room = Room::new("limits");
    let few = ["--size", "32x32", "--element-size", "0.1"];
    let run = room.run([&["render", "-o", "a.png", "--error", "0.01%", "--time", "1s", "--json"], &few[..]].concat());
    let error = &run.result()["error"];
    assert_eq!((&error["achieved"], &error["out_of_time"]), (&false.into(), &true.into()), "{error}");
    let said = room.run([&["render", "-o", "b.png", "--error", "0.01%", "--budget", "1s"], &few[..]].concat());
    assert!(said.code == Some(0) && said.err.contains("NOT reached in the time given"), "{said:?}");
    assert_eq!(room.names(), ["a.png", "b.png"]);

    let near = ["--error", "20%", "--delta-e", "2", "--exposure", "-6"];
    let told = room.run([&["render", "-o", "c.png", "--json"], &few[..], &near].concat()).result();
    let delta_e = told["displayed"]["delta_e"].as_f64().unwrap();
    assert!(delta_e > 0.0 && delta_e <= 2.0 && told["displayed"]["exposure"] == -6.0, "{told}");
    let said = room.run([&["render", "-o", "d.png"], &few[..], &near].concat());
    assert!(said.err.contains("what is displayed is within ΔE "), "{said:?}");
}
