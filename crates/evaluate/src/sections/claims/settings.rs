//! Our settings where the paper gives one: from the code that uses them, and from the cards of the paper's networks.

use std::collections::BTreeMap;

use anyhow::{Context as _, Result};
use catalogue::Network;
use copingnet::{Output, Training};
use cosserat::scene::builtin;
use cosserat::scene::sampling::{Helix, Parameters, Rod, Tree, supplement};
use dataset::{Config, Scenario};
use evaluation::paper::{performance, speedup, temporal};

use crate::context::Context;
use crate::sections::dynamics::varied;
use crate::sections::long_term;
use crate::sections::paper::FREE;

/// By the claim's id: our value, written as the paper's is, and where it is from.
pub(super) type Settings = BTreeMap<String, [String; 2]>;

/// The paper's scenes that are files: name and text.
const SCENES: [(&str, &str); 3] = [
    ("helix-on-plane", include_str!("../../../../scene/scenes/helix-on-plane.toml")),
    ("two-rods", include_str!("../../../../scene/scenes/two-rods.toml")),
    ("knot", include_str!("../../../../scene/scenes/knot.toml")),
];

/// Of a drawn rod and a drawn helix, whose two moduli are the same, what the paper tells: see [`filled`].
const ROD: &str = "phi_0 = {0.shape.straight.angle_deg} deg, N = {0.shape.straight.segments}, l = \
                   {0.shape.straight.length_m} m, Y = {0.youngs_modulus_pa} Pa";
const HELIX: &str = "HR = {0.shape.helix.radius_m} m, HH = {0.shape.helix.height_m} m, HW = {0.shape.helix.winding}, T = \
                     {0.youngs_modulus_pa} Pa, N = {0.shape.helix.segments}";

/// All settings, but for those of the ablation, which come with its summary; `words` has those of the scenes that are files.
pub(super) fn settings(context: &Context, words: &BTreeMap<String, [String; 2]>) -> Result<Settings> {
    let mut settings = Settings::new();
    of_cards(context, &mut settings)?;
    let mut add = |id: &str, at: &str, value: String| settings.insert(id.to_owned(), [value, at.to_owned()]);
    add("data-dt", "dataset::Config::table_1", format!("{} s", number(Config::table_1(Scenario::Rod).dt_s)));
    let ranges = [
        ("rod-segments", Scenario::Rod, "segments", ""),
        ("rod-modulus", Scenario::Rod, "youngs_modulus_pa", " Pa"),
        ("rod-angle", Scenario::Rod, "initial_angle_deg", " deg"),
        ("rod-length", Scenario::Rod, "length_m", " m"),
        ("helix-segments", Scenario::Helix, "segments", ""),
        ("helix-modulus", Scenario::Helix, "torsion_modulus_pa", " Pa"),
        ("helix-radius", Scenario::Helix, "helix_radius_m", " m"),
        ("helix-height", Scenario::Helix, "helix_height_m", " m"),
        ("helix-winding", Scenario::Helix, "winding", ""),
    ];
    for (id, scenario, key, unit) in ranges {
        let [low, high] = scenario.ranges().get(key).copied().unwrap_or([f64::NAN; 2]);
        add(id, "dataset::Scenario::ranges", format!("{} to {}{unit}", number(low), number(high)));
    }
    let counts = [
        ("node-inputs", "graph::paper::NODE", graph::paper::NODE),
        ("edge-inputs", "graph::paper::EDGE", graph::paper::EDGE),
        ("node-outputs", "graph::paper::NODE_TARGET", graph::paper::NODE_TARGET),
        ("edge-outputs", "graph::paper::EDGE_TARGET", graph::paper::EDGE_TARGET),
        ("knn-neighbours", "knn::Params::default", knn::Params::default().neighbours),
        ("performance-simulations", "performance::SIMULATIONS", performance::SIMULATIONS),
        ("performance-steps", "performance::STEPS", performance::STEPS),
        ("temporal-simulations", "temporal::SIMULATIONS", temporal::SIMULATIONS),
        ("temporal-window", "temporal::WINDOW", temporal::WINDOW),
        ("trees-topologies", "speedup::TOPOLOGIES", speedup::TOPOLOGIES),
        ("trees-training-rods", "scene::sampling::Tree::default", Tree::default().rods),
    ];
    for (id, at, value) in counts {
        add(id, at, value.to_string());
    }
    for rods in [10, 20, 40, 70] {
        let (scene, at) = (builtin(&format!("tree-{rods}"))?, format!("scenes/tree-{rods}.toml"));
        add(&format!("trees-{rods}-rods"), &at, scene.rods.len().to_string());
        add(&format!("trees-{rods}-nodes"), &at, scene.model.segments.len().to_string());
    }
    let [rod, helix] = [Parameters::Rod(Rod::default()), Parameters::Helix(Helix::default())];
    let parameters = [
        ("temporal-rod", "temporal::rod", ROD, temporal::rod()),
        ("temporal-helix", "temporal::helix", HELIX, temporal::helix()),
        ("stability-rod", "long_term::rod", ROD, long_term::rod(Rod::default().youngs_modulus)),
        ("dynamic-rod", "scene::sampling::Rod::default", ROD, rod),
        ("dynamic-helix", "scene::sampling::Helix::default", HELIX, helix),
        ("comparisons-rod", "scene::sampling::Rod::default", ROD, rod),
        ("comparisons-helix", "scene::sampling::Helix::default", HELIX, helix),
    ];
    for (id, at, words, parameters) in parameters {
        add(id, at, filled(words, &parameters.to_toml())?);
    }
    for (id, [name, words]) in words {
        let text = SCENES.iter().find(|(known, _)| known == name).map(|(_, text)| *text);
        let text = text.with_context(|| format!("claims.toml: no scene {name:?}"))?;
        add(id, &format!("scenes/{name}.toml"), filled(words, text)?);
    }
    for (figure, scenes) in supplement() {
        let words = |parameters: &Parameters| match &varied(figure, parameters)[..] {
            [one] => number(*one),
            several => format!("({})", several.iter().map(|&value| number(value)).collect::<Vec<_>>().join(", ")),
        };
        let values: Vec<String> = scenes.iter().map(words).collect();
        add(&format!("dynamic-{figure}"), "scene::sampling::supplement", values.join(", "));
    }
    Ok(settings)
}

/// What the cards of the paper's networks say: those of rods and helices, and of knots and trees.
fn of_cards(context: &Context, settings: &mut Settings) -> Result<()> {
    let mut add = |id: &str, scenarios: &[Scenario], read: &dyn Fn(&Network) -> String| -> Result<()> {
        let of = |scenario: &Scenario| context.library.paper_network(*scenario, read);
        let mut values: Vec<String> = scenarios.iter().map(of).collect::<Result<_>>()?;
        if values.iter().all(|value| *value == values[0]) {
            values.truncate(1);
        } else {
            values = scenarios.iter().zip(&values).map(|(scenario, value)| format!("{scenario}: {value}")).collect();
        }
        let names = scenarios.iter().map(|scenario| format!("{scenario}-paper")).collect::<Vec<_>>().join(", ");
        settings.insert(id.to_owned(), [values.join("; "), format!("the cards of {names}")]);
        Ok(())
    };
    // All trainings of a network, one after the other, repetitions left out.
    let in_turn = |read: fn(&Training) -> String| {
        move |network: &Network| {
            let mut values: Vec<String> = network.card().trainings().map(read).collect();
            values.dedup();
            values.join(", then ")
        }
    };
    let trajectories = in_turn(|training| told(training.trajectories));
    let steps = in_turn(|training| told(training.steps));
    add("data-steps", &FREE, &steps)?;
    add("data-train", &FREE, &trajectories)?;
    add("temporal-trained", &FREE, &steps)?;
    add("data-validation", &FREE, &|network| {
        // "... of 30 validation scenes"
        let scenes = |steps: &str| steps.strip_suffix(" validation scenes")?.rsplit(' ').next().map(str::to_owned);
        let scenes = network.card().measured.first().and_then(|measured| scenes(&measured.steps));
        let all = Config::table_1(Scenario::Rod).validation_trajectories;
        format!("{all}, of which {} are measured", scenes.unwrap_or_else(|| "an unknown number".to_owned()))
    })?;
    add("knot-training", &[Scenario::Knot], &trajectories)?;
    add("knot-training-frames", &[Scenario::Knot], &steps)?;
    add("trees-training", &[Scenario::Tree], &trajectories)?;
    add("trees-training-nodes", &[Scenario::Tree], &|network| {
        let trees = network.card().training.trajectories.unwrap_or(0) as u64;
        let seed = Config::table_1(Scenario::Tree).seed;
        let scenes = (0..trees).map_while(|index| Scenario::Tree.sample(seed, index).scene().ok());
        let nodes: usize = scenes.map(|scene| scene.model.segments.len()).sum();
        format!("{:.0}", nodes as f64 / trees as f64)
    })?;
    add("network-blocks", &Scenario::ALL, &|network| network.sizes().gn_blocks.to_string())?;
    add("network-layers", &Scenario::ALL, &|network| network.sizes().mlp_layers.to_string())?;
    add("network-width", &Scenario::ALL, &|network| network.sizes().width.to_string())?;
    add("network-output", &Scenario::ALL, &|network| match network.sizes().output {
        Output::Tanh => "[-1, 1] by tanh, times recorded norms".to_owned(),
        Output::Linear => "without bounds".to_owned(),
    })?;
    let loss =
        in_turn(|training| if training.loss == "mse" { "MSE(V) + MSE(E)".to_owned() } else { training.loss.clone() });
    let machine = in_turn(|training| format!("a processor, {} threads, {}", training.threads, training.backend));
    add("training-loss", &Scenario::ALL, &loss)?;
    add("training-rate", &FREE, &in_turn(|training| format!("{}, {}", training.learning_rate, training.schedule)))?;
    add("training-machine", &FREE, &machine)?;
    for scenario in FREE {
        add(&format!("training-hours-{scenario}"), &[scenario], &|network| {
            let (card, minutes) = (network.card(), |seconds: f64| format!("{:.1} minutes", seconds / 60.0));
            match card.trainings().count() {
                1 => minutes(card.seconds()),
                count => format!("{} in {count} trainings, one after the other", minutes(card.seconds())),
            }
        })?;
    }
    for (id, more) in [("data-validation", "dataset::Config"), ("trees-training-nodes", "trees of the data sets' seed")]
    {
        settings.get_mut(id).context(id)?[1] += &format!(", and {more}");
    }
    Ok(())
}

fn told(value: Option<usize>) -> String {
    value.map_or("not recorded".to_owned(), |value| value.to_string())
}

/// As short as it can be, to nine digits after the point: 0.02, 45, 1e5.
fn number(value: f64) -> String {
    let rounded = (value * 1e9).round() / 1e9;
    if rounded.abs() >= 1e4 { format!("{rounded:e}") } else { format!("{rounded}") }
}

/// Words with numbers of a scene's rods in them, by their places in its file: `{0.radius_m}`.
fn filled(words: &str, file: &str) -> Result<String> {
    let file: toml::Value = toml::from_str(file)?;
    let number_at = |path: &str| {
        let value = path.split('.').try_fold(file.get("rods")?, |value, key| match key.parse::<usize>() {
            Ok(place) => value.get(place),
            Err(_) => value.get(key),
        })?;
        Some(number(value.as_float().or_else(|| Some(value.as_integer()? as f64))?))
    };
    let part = |(k, part): (usize, &str)| match k % 2 {
        0 => Ok(part.to_owned()),
        _ => number_at(part).with_context(|| format!("a scene without {part}")),
    };
    words.split(['{', '}']).enumerate().map(part).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// A card as its file has it, read without any of the code above.
    fn card(scenario: Scenario) -> toml::Table {
        let file = format!("../../checkpoints/{scenario}-paper.toml");
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
        std::fs::read_to_string(file).unwrap().parse().unwrap()
    }

    /// The trainings of a card, the first one first.
    fn trainings(scenario: Scenario) -> Vec<toml::Table> {
        let card = card(scenario);
        let before = card.get("before").and_then(toml::Value::as_array).cloned().unwrap_or_default();
        let own = toml::Value::Table(card);
        before.iter().chain([&own]).map(|leg| leg["training"].as_table().unwrap().clone()).collect()
    }

    /// Their values, one after the other, repetitions left out.
    fn in_turn(scenario: Scenario, key: &str) -> String {
        let mut values: Vec<String> = trainings(scenario).iter().map(|training| training[key].to_string()).collect();
        values.dedup();
        values.join(", then ")
    }

    #[test]
    fn every_setting_row_is_what_the_cards_say() {
        let settings = settings(&Context::for_tests(), &super::super::paper().unwrap().scenes).unwrap();
        let ours = |id: &str| settings[id][0].as_str();
        for (id, scenario, key) in [
            ("data-train", Scenario::Rod, "trajectories"),
            ("data-train", Scenario::Helix, "trajectories"),
            ("data-steps", Scenario::Rod, "steps"),
            ("data-steps", Scenario::Helix, "steps"),
            ("temporal-trained", Scenario::Rod, "steps"),
            ("knot-training", Scenario::Knot, "trajectories"),
            ("knot-training-frames", Scenario::Knot, "steps"),
            ("trees-training", Scenario::Tree, "trajectories"),
        ] {
            assert_eq!(ours(id), in_turn(scenario, key), "{id}");
            assert!(settings[id][1].contains("card"), "{id}");
        }
        for scenario in FREE {
            let seconds: f64 = trainings(scenario).iter().map(|training| training["seconds"].as_float().unwrap()).sum();
            let row = ours(&format!("training-hours-{scenario}"));
            assert!(row.starts_with(&format!("{:.1} minutes", seconds / 60.0)), "{scenario}: {row}");
            assert!(row.contains(&format!("in {} trainings", trainings(scenario).len())), "{scenario}: {row}");
            for training in trainings(scenario) {
                let own = |key: &str| training[key].to_string().replace('"', "");
                let rate = format!("{}, {}", own("learning_rate"), own("schedule"));
                assert!(ours("training-rate").contains(&rate), "{rate}");
                assert!(ours("training-machine").contains(&format!("{} threads", own("threads"))));
                assert_eq!((own("loss").as_str(), ours("training-loss")), ("mse", "MSE(V) + MSE(E)"));
                // What the card says in words of the data set is what it says in numbers.
                let command = own("command");
                let [trajectories, steps] = ["trajectories", "steps"].map(|key| format!("--{key} {}", own(key)));
                assert!(command.contains(&trajectories) && command.contains(&steps), "{command}");
            }
        }
        let measured = card(Scenario::Rod)["measured"][0]["steps"].as_str().unwrap().to_owned();
        assert!(measured.ends_with(" of 30 validation scenes"), "{measured}");
        assert_eq!(ours("data-validation"), "100, of which 30 are measured");
        assert!(settings["data-validation"][1].contains("dataset::Config"));
        // The mean number of nodes of those trees that the card counts.
        let trees: u64 = in_turn(Scenario::Tree, "trajectories").parse().unwrap();
        let nodes = |index| Scenario::Tree.sample(0, index).scene().unwrap().model.segments.len() as f64;
        let mean = (0..trees).map(nodes).sum::<f64>() / trees as f64;
        assert_eq!(ours("trees-training-nodes"), format!("{mean:.0}"));
        assert!(settings["trees-training-nodes"][1].contains("seed"));
        for scenario in Scenario::ALL {
            let network = card(scenario)["network"].clone();
            for (id, key) in
                [("network-blocks", "gn_blocks"), ("network-layers", "mlp_layers"), ("network-width", "width")]
            {
                assert_eq!(ours(id), network[key].to_string(), "{scenario}: {key}");
            }
            assert!(ours("network-output").contains(network["output"].as_str().unwrap()));
        }
    }
}
