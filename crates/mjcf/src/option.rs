//! The sections `compiler` and `option`, and what a file says that a scene has no use for.

use nalgebra::Vector3;

use crate::error::Result;
use crate::xml::Element;

/// What was left out or approximated.
#[derive(Clone, Default)]
pub(crate) struct Notes {
    said: Vec<String>,
    /// Of what concerns looks or numerical methods alone: what, and where it was met first.
    unused: Vec<(String, String)>,
}

impl Notes {
    /// Notes down what of an element is left out or approximated.
    pub(crate) fn say(&mut self, element: &Element, message: &str) {
        let note = format!("{}: {message}", element.label());
        if !self.said.contains(&note) {
            self.said.push(note);
        }
    }

    /// Notes down something that changes neither shapes nor forces.
    pub(crate) fn unused(&mut self, element: &Element, what: &str) {
        if self.unused.iter().all(|(known, _)| known != what) {
            self.unused.push((what.to_owned(), element.label()));
        }
    }

    /// All of them, the looks in one sentence.
    pub(crate) fn sentences(&self) -> Vec<String> {
        let mut sentences = self.said.clone();
        if let Some((_, place)) = self.unused.first() {
            let names: Vec<&str> = self.unused.iter().map(|(name, _)| name.as_str()).collect();
            let place = place.split(": ").next().unwrap_or_default();
            sentences.push(format!("{place}: of no use here, and left out: {}", names.join(", ")));
        }
        sentences
    }
}

/// How the rest of the file is to be read.
#[derive(Clone, Debug)]
pub(crate) struct Compiler {
    degrees: bool,
    /// Three letters of xyzXYZ.
    pub(crate) eulerseq: [char; 3],
    pub(crate) autolimits: bool,
    /// Folder of meshes, with a slash at its end if it is not empty.
    pub(crate) meshdir: String,
}

impl Default for Compiler {
    fn default() -> Self {
        Self { degrees: true, eulerseq: ['x', 'y', 'z'], autolimits: true, meshdir: String::new() }
    }
}

impl Compiler {
    pub(crate) fn radians(&self, angle: f64) -> f64 {
        if self.degrees { angle.to_radians() } else { angle }
    }

    /// Reads all sections `compiler` of a file, one after the other.
    pub(crate) fn read(root: &Element) -> Result<Self> {
        const READ: [&str; 10] = [
            "angle",
            "eulerseq",
            "autolimits",
            "meshdir",
            "assetdir",
            "coordinate",
            "inertiafromgeom",
            "settotalmass",
            "boundmass",
            "boundinertia",
        ];
        const HARMLESS: [&str; 13] = [
            "texturedir",
            "discardvisual",
            "usethread",
            "fitaabb",
            "fusestatic",
            "strippath",
            "convexhull",
            "alignfree",
            "balanceinertia",
            "exactmeshinertia",
            "saveinertial",
            "inertiagrouprange",
            "conflict",
        ];
        let mut compiler = Self::default();
        for section in root.children_of("compiler") {
            section.knows(&READ, &HARMLESS)?;
            let degrees = if compiler.degrees { "degree" } else { "radian" };
            compiler.degrees = section.choice("angle", &["degree", "radian"], degrees)? == "degree";
            compiler.autolimits = section.is_true("autolimits", compiler.autolimits)?;
            section.choice("coordinate", &["local"], "local")?;
            section.choice("inertiafromgeom", &["auto", "false"], "auto")?;
            for name in ["boundmass", "boundinertia"] {
                if section.number(name, 0.0)? > 0.0 {
                    return section.must_be(name, "0: masses are those of the geoms");
                }
            }
            if section.number("settotalmass", -1.0)? > 0.0 {
                return section.must_be("settotalmass", "-1: masses are those of the geoms");
            }
            if let Some(sequence) = section.text("eulerseq") {
                let letters: Vec<char> = sequence.chars().collect();
                compiler.eulerseq = match <[char; 3]>::try_from(letters) {
                    Ok(letters) if letters.iter().all(|letter| "xyzXYZ".contains(*letter)) => letters,
                    _ => return section.must_be("eulerseq", "three letters of xyzXYZ"),
                };
            }
            if let Some(folder) = section.text("meshdir").or(section.text("assetdir")) {
                let slash = if folder.is_empty() || folder.ends_with('/') { "" } else { "/" };
                compiler.meshdir = format!("{folder}{slash}");
            }
        }
        Ok(compiler)
    }
}

/// The section `option`.
#[derive(Clone, Debug)]
pub(crate) struct Options {
    /// Time step [s].
    pub(crate) timestep: f64,
    /// [m/s^2]; zero where it is switched off.
    pub(crate) gravity: Vector3<f64>,
    /// Density of what surrounds the bodies [kg/m^3].
    pub(crate) density: f64,
    /// [m/s]
    pub(crate) wind: Vector3<f64>,
    /// Whether anything touches anything.
    pub(crate) contacts: bool,
    /// Whether equality constraints hold.
    pub(crate) equalities: bool,
    /// Whether actuators act.
    pub(crate) actuation: bool,
}

impl Options {
    /// Reads all sections `option` of a file, one after the other.
    pub(crate) fn read(root: &Element, notes: &mut Notes) -> Result<Self> {
        const READ: [&str; 5] = ["timestep", "gravity", "density", "viscosity", "wind"];
        // How MuJoCo solves its equations.
        const METHODS: [&str; 17] = [
            "integrator",
            "cone",
            "jacobian",
            "solver",
            "iterations",
            "tolerance",
            "ls_iterations",
            "ls_tolerance",
            "noslip_iterations",
            "noslip_tolerance",
            "ccd_iterations",
            "ccd_tolerance",
            "mpr_iterations",
            "mpr_tolerance",
            "sdf_iterations",
            "sdf_initpoints",
            "impratio",
        ];
        const OTHERS: [&str; 6] =
            ["apirate", "magnetic", "actuatorgroupdisable", "sleep_tolerance", "collision", "o_margin"];
        let mut options = Self {
            timestep: 0.002,
            gravity: Vector3::new(0.0, 0.0, -9.81),
            density: 0.0,
            wind: Vector3::zeros(),
            contacts: true,
            equalities: true,
            actuation: true,
        };
        let mut has_gravity = true;
        for section in root.children_of("option") {
            section.knows(&READ, &[&METHODS[..], &OTHERS].concat())?;
            options.timestep = section.positive("timestep", options.timestep, "s")?;
            options.gravity = section.vector("gravity")?.unwrap_or(options.gravity);
            options.wind = section.vector("wind")?.unwrap_or(options.wind);
            options.density =
                if section.has("density") { section.not_negative("density", "kg/m^3")? } else { options.density };
            if section.not_negative("viscosity", "Pa s")? > 0.0 {
                return section
                    .must_be("viscosity", "0: scenes have drag that grows with the square of the speed alone");
            }
            for method in METHODS.iter().chain(&OTHERS).filter(|name| section.has(name)) {
                notes.unused(section, &format!("option {method}"));
            }
            for part in &section.children {
                if part.tag != "flag" {
                    return part.wrong("is not known in <option>");
                }
                for attribute in &part.attributes {
                    let on = part.choice(&attribute.name, &["enable", "disable"], "enable")? == "enable";
                    match attribute.name.as_str() {
                        "gravity" => has_gravity = on,
                        "contact" => options.contacts = on,
                        "equality" => options.equalities = on,
                        "actuation" => options.actuation = on,
                        "constraint" => {
                            options.contacts &= on;
                            options.equalities &= on;
                        }
                        "passive" | "spring" | "damper" if !on => {
                            return part
                                .must_be(&attribute.name, "enable: cables without stiffness and damping are not read");
                        }
                        _ => notes.unused(part, &format!("flag {}", attribute.name)),
                    }
                }
            }
        }
        if !has_gravity {
            options.gravity = Vector3::zeros();
        }
        Ok(options)
    }
}
