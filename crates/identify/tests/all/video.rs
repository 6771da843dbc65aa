//! Cables that one or two cameras filmed: what is identified of the pictures is what is identified of the markers.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use identify::cable::Cable;
use identify::fit::{Search, Stage, fit};
use identify::parameter::{Parameter, Parameters};
use identify::recording::{Reading, Recording, files, read_all};
use identify::simulated::{Plan, recordings};
use identify::spline;
use identify::video::{Centreline, Video, VideoError, markers, read};
use nalgebra::{Rotation3, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const IMAGE: [f64; 2] = [1920.0, 1080.0];

/// A camera that stands still.
struct Camera {
    focal: f64,
    at: Vector3<f64>,
    /// From its axes (to the right, down, forward) to the world's.
    turn: Rotation3<f64>,
}

impl Camera {
    /// At a place, looking at another one, upright.
    fn new(focal: f64, at: Vector3<f64>, to: Vector3<f64>) -> Self {
        let forward = (to - at).normalize();
        let right = forward.cross(&Vector3::z()).normalize();
        let turn = Rotation3::from_basis_unchecked(&[right, forward.cross(&right), forward]);
        Self { focal, at, turn }
    }

    fn sees(&self, point: Vector3<f64>) -> Vector2<f64> {
        let local = self.turn.inverse() * (point - self.at);
        assert!(local.z > 0.0);
        Vector2::new(IMAGE[0], IMAGE[1]) * 0.5 + local.xy() * (self.focal / local.z)
    }
}

/// The curve through the markers of a frame at so many even places, and its length.
fn curve(markers: &[Vector3<f64>], count: usize) -> (Vec<Vector3<f64>>, f64) {
    let nodes = spline::through(markers, 40);
    let mut way = vec![0.0];
    nodes.windows(2).for_each(|pair| way.push(way[way.len() - 1] + (pair[1] - pair[0]).norm()));
    let length = way[way.len() - 1];
    let at = |s: f64| {
        let next = way.partition_point(|own| *own < s * length).clamp(1, nodes.len() - 1);
        let share = (s * length - way[next - 1]) / (way[next] - way[next - 1]);
        nodes[next - 1].lerp(&nodes[next], share)
    };
    ((0..count).map(|k| at(k as f64 / (count - 1) as f64)).collect(), length)
}

/// What a camera sees of a recording, off by some pixels in each coordinate of 60 points, and the cable's length.
fn filmed(recording: &Recording, camera: &Camera, noise: f64, seed: u64) -> (Centreline, f64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
    let mut lengths = Vec::new();
    let mut points = Vec::new();
    for row in &recording.markers {
        let known: Vec<_> = row.iter().copied().filter(|marker| !marker.x.is_nan()).collect();
        let (curve, length) = curve(&known, 60);
        lengths.push(length);
        let mut seen = |(k, point): (usize, &Vector3<f64>)| {
            let off = Vector2::new(normal(), normal()) * noise;
            (k as f64 / 59.0, camera.sees(*point) + off)
        };
        points.push(curve.iter().enumerate().map(&mut seen).collect());
    }
    let frames = (0..recording.frames() as i64).collect();
    let length = lengths.iter().sum::<f64>() / lengths.len() as f64;
    (Centreline { path: recording.path.clone(), frames, time: recording.time.clone(), points }, length)
}

/// Bending stiffness and inner damping of recordings, by rods of so many segments between markers.
fn identified(recordings: &[Recording], segments: usize) -> [f64; 2] {
    let cables: Vec<Cable> = recordings.iter().map(|own| Cable::new(own, segments).unwrap()).collect();
    let free = vec![
        Parameter::Bending,
        Parameter::InnerDamping,
        Parameter::Curvature1,
        Parameter::Curvature2,
        Parameter::TiltX,
        Parameter::TiltY,
    ];
    let search = Search::of(free, vec![Stage::of_all(240, 8)]);
    let fit = fit(recordings, &cables, &Parameters::default(), &search, &mut |_| true).unwrap();
    [Parameter::Bending, Parameter::InnerDamping].map(|parameter| fit.parameters[parameter])
}

/// Asserts that bending stiffness and inner damping are within a tenth of those of markers.
fn is_near(found: [f64; 2], expected: [f64; 2]) {
    for (name, k) in [("bending", 0), ("damping", 1)] {
        assert!((found[k] / expected[k] - 1.0).abs() < 0.1, "{name} {}, by markers {}", found[k], expected[k]);
    }
}

/// A video whose cameras are not known, of a cable whose grips hold so much of it.
fn video(length: f64, grip: f64) -> Video {
    Video { length, grip, image: IMAGE, focal: None, pitch: 0.0, window: 0.1, markers: 31 }
}

/// The length that grips hold: from the first marker to the second.
fn grip(recordings: &[Recording]) -> f64 {
    (recordings[0].markers[0][1] - recordings[0].markers[0][0]).norm()
}

fn truth() -> Parameters {
    let mut truth = Parameters::default();
    (truth[Parameter::Bending], truth[Parameter::InnerDamping]) = (0.035, 0.05);
    truth[Parameter::Curvature2] = 0.8;
    truth
}

/// Recordings of a cable that has come to move as its grips do: it begins as it is drawn, and jerks.
fn simulated(is_planar: bool) -> Vec<Recording> {
    let plan = Plan { frames: 300, markers: 31, pace: 3.0, is_planar, ..Plan::default() };
    let mut all = recordings(&truth(), &plan).unwrap();
    for own in &mut all {
        own.markers.drain(..40);
        own.time.truncate(260);
        // What a grip holds keeps its length.
        let last = own.count() - 1;
        for [outer, inner] in [[0, 1], [last, last - 1]] {
            let length = (own.markers[0][outer] - own.markers[0][inner]).norm();
            for row in &mut own.markers {
                row[outer] = row[inner] + (row[outer] - row[inner]).normalize() * length;
            }
        }
    }
    all
}

#[test]
fn one_camera_tells_what_all_markers_do_of_a_motion_in_a_plane() {
    let real = simulated(true);
    let camera = Camera::new(1500.0, Vector3::new(0.4, -1.3, 0.3), Vector3::new(0.0, 0.0, -0.12));
    let expected = identified(&real, 3);
    for noise in [1.0, 3.0] {
        let seen: Vec<_> = real.iter().zip(0..).map(|(own, seed)| filmed(own, &camera, noise, seed)).collect();
        let length = seen.iter().map(|(_, length)| length).sum::<f64>() / seen.len() as f64;
        let clips: Vec<_> = seen.into_iter().map(|(clip, _)| (clip, None)).collect();
        let found = markers(&clips, &video(length, grip(&real))).unwrap();
        let [bending, damping] = identified(&found.recordings, 3);
        println!("{noise} px: {found:?}", found = (&found.focal, found.angle.to_degrees(), found.stretch));
        println!("{noise} px: bending {bending}, damping {damping}, by markers {expected:?}");
        is_near([bending, damping], expected);
    }
}

#[test]
fn two_cameras_tell_it_of_any_motion() {
    let real = simulated(false);
    let middle = Vector3::new(0.0, 0.0, -0.12);
    let cameras = [
        Camera::new(1500.0, Vector3::new(-0.5, -1.3, -0.12), middle),
        Camera::new(1300.0, Vector3::new(0.9, -1.1, 0.2), middle + Vector3::x() * 0.05),
    ];
    let noise = 3.0;
    let seen: Vec<_> = real
        .iter()
        .zip(0..)
        .map(|(own, seed)| [0, 1].map(|k| filmed(own, &cameras[k], noise, 2 * seed + k as u64)))
        .collect();
    let length = seen.iter().map(|[(_, length), _]| length).sum::<f64>() / seen.len() as f64;
    let clips: Vec<_> = seen.into_iter().map(|[(one, _), (other, _)]| (one, Some(other))).collect();
    let found = markers(&clips, &video(length, grip(&real))).unwrap();
    let (expected, [bending, damping]) = (identified(&real, 3), identified(&found.recordings, 3));
    let angle = found.angle.to_degrees();
    println!("{noise} px: {:?}, {angle} deg, missed {} px, stretch {}", found.focal, found.missed, found.stretch);
    println!("{noise} px: bending {bending}, damping {damping}, by markers {expected:?}");
    is_near([bending, damping], expected);
}

/// A motion that leaves its plane is refused where one camera sees it.
#[test]
fn what_one_camera_cannot_tell_is_refused() {
    let real = simulated(false);
    let camera = Camera::new(1500.0, Vector3::new(1.5, -0.2, -0.12), Vector3::new(0.0, 0.0, -0.12));
    let (clip, length) = filmed(&real[0], &camera, 1.0, 3);
    let Err(VideoError::Cameras(error)) = markers(&[(clip, None)], &video(length, grip(&real))) else {
        panic!("it is accepted")
    };
    assert!(error.contains("does it move in one plane"), "{error}");
}

/// A centreline as a table.
fn table(clip: &Centreline) -> String {
    let mut text = "frame,s,u,v\n".to_owned();
    for (frame, points) in clip.frames.iter().zip(&clip.points) {
        points.iter().for_each(|(s, at)| text += &format!("{frame},{s},{},{}\n", at.x, at.y));
    }
    text
}

/// Recordings of real cables, seen by two cameras that are not real: the program finds of both what it finds of the markers. The damping of
/// the air is held: with 12 recordings it is not told from the inner one. `REAL_CABLES` names the folder of recordings.
#[test]
fn two_cameras_see_a_real_cable_as_markers_do() {
    let Some(folder) = std::env::var_os("REAL_CABLES").map(PathBuf::from) else {
        eprintln!("skipped: REAL_CABLES=FOLDER names the folder of recordings, with deform/DLO1/train and so on in it");
        return;
    };
    let place = tempfile::tempdir().unwrap();
    let program = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_identify")).args(arguments).output().unwrap();
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    };
    let at = |name: &str| place.path().join(name).to_str().unwrap().to_owned();
    let identified = |recordings: &[&str]| {
        let out = at("out");
        program(&[recordings, &["--hold", "outer-damping=0.3", "--quiet", "--out", &out]].concat());
        let text = fs::read_to_string(PathBuf::from(&out).join("result.json")).unwrap();
        let result: serde_json::Value = serde_json::from_str(&text).unwrap();
        ["bending", "inner-damping"].map(|name| result["parameters"][name]["value"].as_f64().unwrap())
    };
    for cable in ["DLO1", "DLO2", "DLO3"] {
        let paths = files(&[folder.join("deform").join(cable).join("train")]).unwrap();
        let paths: Vec<&str> = paths[..12].iter().map(|path| path.to_str().unwrap()).collect();
        let expected = identified(&paths);
        let (real, _) = read_all(&paths.iter().map(PathBuf::from).collect::<Vec<_>>(), Reading::default());
        let middle = real[0].markers[0].iter().sum::<Vector3<f64>>() / real[0].count() as f64;
        let cameras = [
            Camera::new(1100.0, middle + Vector3::new(-0.8, -1.8, 0.0), middle),
            Camera::new(1100.0, middle + Vector3::new(1.2, -1.6, 0.1), middle),
        ];
        for noise in [1.0, 3.0] {
            let mut lengths = Vec::new();
            for (recording, seed) in real.iter().zip(0..) {
                for (k, camera) in cameras.iter().enumerate() {
                    let (clip, length) = filmed(recording, camera, noise, 2 * seed + k as u64);
                    lengths.push(length);
                    fs::create_dir_all(at(&format!("{cable}-{k}"))).unwrap();
                    fs::write(at(&format!("{cable}-{k}/{}.csv", recording.name())), table(&clip)).unwrap();
                }
            }
            let length = lengths.iter().sum::<f64>() / lengths.len() as f64;
            let [first, second, out] = ["0", "1", "recordings"].map(|name| at(&format!("{cable}-{name}")));
            let (long, grip) = (length.to_string(), grip(&real).to_string());
            program(&[
                "video",
                &first,
                "--second",
                &second,
                "--length-m",
                &long,
                "--grip-m",
                &grip,
                "--image-px",
                "1920x1080",
                "--out",
                &out,
            ]);
            let found = identified(&[&out]);
            println!("{cable}, {noise} px: bending and inner damping {found:?}, by markers {expected:?}");
            is_near(found, expected);
        }
    }
}

#[test]
fn what_is_wrong_with_a_centreline_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let told = |text: &str| {
        let path = folder.path().join("clip.csv");
        fs::write(&path, text).unwrap();
        let error = read(&path, 100.0).err().map(|error| error.to_string()).unwrap_or_default();
        error.replace(&format!("{}: ", path.display()), "")
    };
    for (text, expected) in [
        ("frame,s,u\n", "there is no column \"v\": a centreline has frame, s, u and v"),
        ("frame,s,u,v\n0,0,1,x\n", "line 2, column v: \"x\" is no number"),
        ("frame,s,u,v\n0,0,1,1\n0.5,0,1,1\n", "line 3, column frame: 0.5, but it must be a whole number"),
        ("frame,s,u,v\n0,50,1,1\n", "line 2, column s: 50, but it must be from 0 to 1, a share of the length"),
        ("frame,s,u,v\n0,0,1,1\n1,0,1,\n", "2 frames, but there must be at least 3"),
    ] {
        assert_eq!(told(text), expected, "{text}");
    }
    let sparse: String = (0..9).map(|frame| format!("{frame},0.1,5,5\n{frame},0.2,5,6\n")).collect();
    let path = folder.path().join("clip.csv");
    fs::write(&path, format!("frame,s,u,v\n{sparse}")).unwrap();
    let error = markers(&[(read(&path, 100.0).unwrap(), None)], &video(1.0, 0.02)).unwrap_err().to_string();
    assert!(error.ends_with("0 of 9 frames show points all along the cable, but at least 11 must: 9 or more points, none further apart than 0.15"), "{error}");
    let folder = folder.path().to_str().unwrap();
    for (out, expected) in [(folder, "clips are there"), ("elsewhere", "0 of 9 frames show")] {
        let arguments = ["video", folder, "--length-m", "1", "--image-px", "640x480", "--out", out];
        let output = Command::new(env!("CARGO_BIN_EXE_identify")).args(arguments).output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && told.contains(expected), "{told}");
    }
}
