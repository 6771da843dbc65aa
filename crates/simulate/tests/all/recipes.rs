//! The scenes of `docs/recipes.md` run.

use crate::common::json;

const RECIPES: &str = include_str!("../../../../docs/recipes.md");

/// The block of a kind in a recipe, and the text before it.
fn block<'a>(recipe: &'a str, kind: &str) -> Option<(&'a str, &'a str)> {
    let (before, rest) = recipe.split_once(&format!("```{kind}\n"))?;
    Some((before, rest.split_once("```")?.0))
}

#[test]
fn every_recipe_runs() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("recipe.toml");
    let recipes: Vec<&str> = RECIPES.split("\n## ").skip(1).collect();
    assert_eq!(recipes.len(), 18);
    for recipe in recipes {
        if let Some((before, table)) = block(recipe, "csv") {
            let name = before.trim_end().rsplit('`').nth(1).expect("a file's name");
            std::fs::write(folder.path().join(name), table).expect("a table");
        }
        let (_, scene) = block(recipe, "toml").expect(recipe);
        std::fs::write(&path, scene).expect("a scene");
        let summary = json(&[path.to_str().expect("UTF-8"), "--steps", "40"]);
        let title = recipe.lines().next().unwrap_or_default();
        assert_eq!(summary["status"], "converged", "{title}");
    }
}
