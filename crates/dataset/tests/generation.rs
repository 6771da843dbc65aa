//! Generation: the same bits on any number of threads and in any parts, resumable, and never over another set.

mod common;

use std::sync::Mutex;

use common::{files, generated, small};
use dataset::{Config, Dataset, MANIFEST, Manifest, Progress, Scenario, Split, generate};

#[test]
fn threads_and_parts_change_no_bit() {
    let config = small(Scenario::Rod);
    let one = tempfile::tempdir().unwrap();
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool(1).install(|| generate(one.path(), &config, None, &|_| ())).unwrap();
    let three = tempfile::tempdir().unwrap();
    pool(3).install(|| generate(three.path(), &config, None, &|_| ())).unwrap();
    assert!(files(one.path()) == files(three.path()));

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
    assert_eq!((config.scenario, config.train_trajectories, config.validation_trajectories), (Scenario::Rod, 256, 100));
    assert_eq!((config.steps, config.dt_s), (50, 0.02));
    for scenario in Scenario::ALL {
        let ranges = scenario.ranges();
        let [low, high] = ranges["segments"];
        for index in 0..200 {
            let model = scenario.sample(3, index).scene().unwrap().model;
            assert!((low..=high).contains(&(model.segments.len() as f64)));
            let segment = model.segments[0];
            assert_eq!((segment.radius, segment.density), (ranges["radius_m"][0], ranges["density_kg_m3"][1]));
        }
    }
}
