//! OBJ by a parser of its own.

use std::fs;

use export::Format;
use nalgebra::Vector3;

use super::runs::runs;

#[test]
fn vertices_and_polylines_are_read_back() {
    for run in runs() {
        let directory = tempfile::tempdir().unwrap();
        let made = run.export(Format::Obj, directory.path());
        assert_eq!(made, [directory.path().join("obj")]);
        assert_eq!(fs::read_dir(&made[0]).unwrap().count(), run.times.len());
        for (frame, state) in run.states.iter().enumerate() {
            let text = fs::read_to_string(made[0].join(format!("frame_{frame:04}.obj"))).unwrap();
            let (mut vertices, mut lines, mut objects) = (Vec::new(), Vec::new(), Vec::new());
            let mut radii: Vec<Vec<f64>> = Vec::new();
            for line in text.lines() {
                let (element, rest) = line.split_once(' ').unwrap();
                let mut words = rest.split(' ');
                match element {
                    "v" => vertices.push(Vector3::from_fn(|_, _| words.next().unwrap().parse::<f64>().unwrap())),
                    "l" => lines.push(words.map(|word| word.parse::<usize>().unwrap() - 1).collect::<Vec<_>>()),
                    "o" => objects.push(rest.to_owned()),
                    "#" if rest.starts_with("rad") => {
                        let of = words.next();
                        radii.push(words.map(|word| word.parse().unwrap()).collect());
                        assert_eq!(of, Some(if radii[radii.len() - 1].len() == 1 { "radius_m" } else { "radii_m" }));
                    }
                    "#" => {}
                    other => panic!("{other}"),
                }
            }
            assert_eq!(lines, run.lines, "{}, frame {frame}", run.name);
            assert_eq!(objects, (0..lines.len()).map(|rod| format!("rod-{rod}")).collect::<Vec<_>>());
            assert_eq!(radii.len(), lines.len());
            for (line, radii) in lines.iter().zip(&radii) {
                // A closed line names its first vertex twice.
                for (k, &node) in
                    line.iter().enumerate().take(line.len() - usize::from(line[0] == line[line.len() - 1]))
                {
                    let radius = radii[if radii.len() == 1 { 0 } else { k }];
                    assert!((radius - run.node(state, node).1).abs() < 1e-15, "{}, node {node}", run.name);
                }
            }
            assert_eq!(vertices.len(), run.joints.len());
            for (node, vertex) in vertices.iter().enumerate() {
                assert!((vertex - run.node(state, node).0).norm() < 1e-12, "{}, frame {frame}, node {node}", run.name);
            }
        }
    }
}
