//! Generation: the same bits on any number of threads and in any parts, resumable, and never over another set.

use std::sync::Mutex;

use crate::common::{files, generated, small};
use cosserat::scene::sampling::Parameters;
use dataset::{Config, Dataset, MANIFEST, Manifest, Progress, Scenario, Split, generate, open_as};

#[test]
fn threads_and_parts_change_no_bit() {
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let with_threads = |config: &Config, threads| {
        let directory = tempfile::tempdir().unwrap();
        pool(threads).install(|| generate(directory.path(), config, None, &|_| ())).unwrap();
        directory
    };
    for scenario in Scenario::ALL {
        let [one, three] = [1, 3].map(|threads| with_threads(&small(scenario), threads));
        assert!(files(one.path()) == files(three.path()), "{scenario}");
    }

    let config = small(Scenario::Rod);
    let one = with_threads(&config, 1);
    let parts = tempfile::tempdir().unwrap();
    for (i, is_last) in [(2, false), (0, false), (1, true)] {
        let generated = generate(parts.path(), &config, Some((i, 3)), &|_| ()).unwrap();
        assert_eq!(generated.manifest.is_some(), is_last);
    }
    assert!(files(one.path()) == files(parts.path()));
    assert_eq!(Manifest::read(one.path()).unwrap(), Manifest::read(parts.path()).unwrap());
}

#[test]
fn samples_do_not_depend_on_the_size_of_shards() {
    let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let config = small(Scenario::Helix);
    let a = generated(a.path(), &config);
    let b = generated(b.path(), &Config { trajectories_per_shard: 4, ..config });
    assert_eq!((a.norms(), a.manifest().train), (b.norms(), b.manifest().train));
    for split in Split::ALL {
        for (a, b) in a.trajectories(split).zip(b.trajectories(split)) {
            assert_eq!((a.index(), a.len(), a.model()), (b.index(), b.len(), b.model()));
            for (a, b) in a.samples().zip(b.samples()) {
                assert!(a.pose_rows().eq(b.pose_rows()) && a.lambda().eq(b.lambda()) && a.dp().eq(b.dp()));
            }
        }
    }
}

#[test]
fn what_is_there_and_whole_is_kept() {
    let directory = tempfile::tempdir().unwrap();
    let config = small(Scenario::Rod);
    generated(directory.path(), &config);
    let before = files(directory.path());
    let again = || {
        let seen = Mutex::new(Vec::new());
        let generated = generate(directory.path(), &config, None, &|p| seen.lock().unwrap().push(p)).unwrap();
        assert!(generated.manifest.is_some());
        assert!(seen.lock().unwrap().contains(&Progress { done: 7, total: 7 }));
        assert!(files(directory.path()) == before);
        Dataset::open(directory.path()).unwrap();
        (generated.written, generated.kept)
    };
    assert_eq!(again(), (0, 4));
    // Lost, cut off, and with a byte flipped; a lost or damaged entry.
    std::fs::remove_file(directory.path().join("train-0000.safetensors")).unwrap();
    assert_eq!(again(), (1, 3));
    let path = directory.path().join("train-0001.safetensors");
    let mut bytes = std::fs::read(&path).unwrap();
    bytes.truncate(bytes.len() - 1);
    std::fs::write(&path, &bytes).unwrap();
    assert_eq!(again(), (1, 3));
    bytes[5000] ^= 1;
    std::fs::write(&path, &bytes).unwrap();
    assert_eq!(again(), (1, 3));
    std::fs::remove_file(directory.path().join("validation-0000.done.toml")).unwrap();
    std::fs::write(directory.path().join("train-0002.done.toml"), "schema_version = 1").unwrap();
    assert_eq!(again(), (2, 2));
    std::fs::remove_file(directory.path().join(MANIFEST)).unwrap();
    assert_eq!(again(), (0, 4));
}

#[test]
fn another_set_is_not_written_over() {
    let directory = tempfile::tempdir().unwrap();
    let config = small(Scenario::Rod);
    generate(directory.path(), &config, Some((0, 4)), &|_| ()).unwrap();
    let error = generate(directory.path(), &Config { seed: 6, ..config.clone() }, None, &|_| ()).unwrap_err();
    let message = error.to_string();
    assert!(message.ends_with(": config.seed = 5, but it must be 6 to go on in this directory"), "{message}");
    let path = directory.path().join("train-0000.done.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replace("schema_version = 1", "schema_version = 2")).unwrap();
    let message = generate(directory.path(), &config, None, &|_| ()).unwrap_err().to_string();
    assert!(message.contains("schema_version = 2, but it must be 1 (a newer program has written it)"), "{message}");
}

#[test]
fn settings_that_make_no_sense_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let config = small(Scenario::Rod);
    let wrong = [
        (Config { dt_s: 0.0, ..config.clone() }, None, "setting dt_s = 0, but it must be finite and > 0"),
        (Config { dt_s: f64::NAN, ..config.clone() }, None, "setting dt_s = NaN, but it must be finite and > 0"),
        (Config { steps: 0, ..config.clone() }, None, "setting steps = 0, but it must be 1 to 1000000"),
        (
            Config { seed: u64::MAX, ..config.clone() },
            None,
            "setting seed = 18446744073709551615, but it must be at most 9223372036854775807",
        ),
        (config, Some((3, 3)), "setting part = 3/3, but it must be i/n with i from 0 to n - 1"),
    ];
    for (config, part, message) in wrong {
        assert_eq!(generate(directory.path(), &config, part, &|_| ()).unwrap_err().to_string(), message);
    }
    let file = directory.path().join("file");
    std::fs::write(&file, "").unwrap();
    let message = generate(&file, &small(Scenario::Rod), None, &|_| ()).unwrap_err().to_string();
    assert!(message.starts_with("cannot create the directory "), "{message}");
}

#[test]
fn table_1_is_the_default() {
    let config = Config::default();
    assert_eq!(Config::table_1(Scenario::Helix), Config { scenario: Scenario::Helix, ..config.clone() });
    assert_eq!((config.scenario, config.train_trajectories, config.validation_trajectories), (Scenario::Rod, 256, 100));
    assert_eq!((config.steps, config.dt_s), (50, 0.02));
    for scenario in [Scenario::Rod, Scenario::Helix, Scenario::Knot] {
        let ranges = scenario.ranges();
        let [low, high] = ranges["segments"];
        for index in 0..200 {
            let model = scenario.sample(3, index).scene().unwrap().model;
            assert!((low..=high).contains(&(model.segments.len() as f64)));
            let segment = &model.segments[0];
            assert_eq!((segment.radius, segment.density), (ranges["radius_m"][0], ranges["density_kg_m3"][1]));
        }
    }
}

#[test]
fn knots_and_trees_are_as_many_and_as_long_as_in_the_paper() {
    let knots = Config::table_1(Scenario::Knot);
    assert_eq!((knots.train_trajectories, knots.steps, knots.record_every), (20, 100, 1));
    let trees = Config::table_1(Scenario::Tree);
    assert_eq!((trees.train_trajectories, trees.steps, trees.record_every), (100, 100, 5));
    let (knot, tree) = (Scenario::Knot.ranges(), Scenario::Tree.ranges());
    for index in 0..20 {
        let Parameters::Knot(p) = Scenario::Knot.sample(0, index) else { panic!("a knot") };
        let closing = p.speeds[0] + p.speeds[1];
        for (name, value) in [
            ("loop_m", p.loop_diameter),
            ("closing_speed_m_s", closing),
            ("start_share_of_speed", p.speeds[0] / closing),
            ("friction", p.friction),
        ] {
            assert!((knot[name][0]..=knot[name][1]).contains(&value), "{name} = {value}");
        }
        let Parameters::Tree(p) = Scenario::Tree.sample(0, index) else { panic!("a tree") };
        let scene = Parameters::Tree(p).scene().unwrap();
        for (name, value) in [
            ("rods", scene.rods.len() as f64),
            ("wind_speed_m_s", p.wind_speed),
            ("wind_angle_deg", p.wind_angle_deg),
            ("density_kg_m3", scene.model.segments[9].density),
            ("youngs_modulus_pa", scene.model.joints[9].youngs_modulus),
        ] {
            assert!((tree[name][0]..=tree[name][1]).contains(&value), "{name} = {value}");
        }
    }
}

#[test]
fn of_trees_every_third_step_is_kept_and_a_set_with_other_steps_is_another() {
    let directory = tempfile::tempdir().unwrap();
    let config = Config { train_trajectories: 2, validation_trajectories: 0, steps: 7, ..small(Scenario::Tree) };
    let dataset = generated(directory.path(), &config);
    for trajectory in dataset.trajectories(Split::Train) {
        let mut steps: Vec<u32> = trajectory.samples().map(|sample| sample.step()).collect();
        steps.dedup();
        assert_eq!(steps, [0, 3, 6]);
    }
    let error = open_as(directory.path(), &Config { record_every: 1, ..config.clone() }).unwrap_err().to_string();
    assert!(error.ends_with("config.record_every = 3, but it must be 1 to go on in this directory"), "{error}");
    // What older programs wrote says nothing about it, and is read as it was.
    let text = toml::to_string(&Config { record_every: 1, ..config }).unwrap();
    assert!(!text.contains("record_every") && toml::from_str::<Config>(&text).unwrap().record_every == 1);
}
