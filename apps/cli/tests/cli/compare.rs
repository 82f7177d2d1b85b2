//! `radiosity compare`.

use crate::Room;
use serde_json::Value;

/// The page of a comparison stands alone, the numbers are whole, and standard output has both kinds of answer.
#[test]
fn a_comparison_is_written_as_a_page_and_as_numbers() {
    let room = Room::new("compare");
    const FEW: &str = "compare --elements 40 --methods rays,hemicube,exact,cubature --solvers cg,progressive,gauss-seidel --budget 2s";
    let result = room.run(format!("--json -q {FEW} -o a.html -o a.json").split(' ')).result();
    assert_eq!(room.names(), ["a.html", "a.json"]);
    assert_eq!(result["output"], serde_json::json!(["a.html", "a.json"]));
    let numbers: Value = serde_json::from_slice(&room.read("a.json")).unwrap();
    assert_eq!((&numbers["trials"], &numbers["marches"]), (&result["trials"], &result["marches"]));
    assert!(numbers["trials"].as_array().unwrap().iter().any(|t| t["method"] == "rays" && t["light_error"].is_f64()));
    // Of elements that meet in an edge, the centre of one sees something else than the whole of it; exact ones agree.
    let corner = |method: &str| {
        let is_single = |t: &&Value| t["method"] == method && !t["label"].as_str().unwrap().contains("points");
        let trial = numbers["trials"].as_array().unwrap().iter().rfind(is_single).unwrap();
        [0, 1].map(|k| trial["wrong"]["corner"]["factors"][k].as_f64().unwrap())
    };
    let ([seen, whole], [closed, same]) = (corner("hemicube"), corner("exact"));
    assert!((seen / whole - 1.0).abs() > 0.05 && (closed / same - 1.0).abs() < 1e-6, "{seen} {whole} {closed} {same}");
    let page = String::from_utf8(room.read("a.html")).unwrap();
    assert!(page.contains(&format!("takes {seen:.4} of what it sees, on the mean over all its places {whole:.4}")));
    for outside in ["http:", "https:", "//", "<script", "<link", "@import"] {
        let own =
            page.split("base64,").map(|part| part.split_once('"').map_or(part, |(_, rest)| rest)).collect::<String>();
        assert!(!own.contains(outside), "{outside}");
    }
    for said in [
        "When shooting",
        "What each got wrong",
        "gauss-seidel",
        "data:image/png",
        "Content-Security-Policy",
        "<dt>Sweep</dt>",
        "<dt>Of full white</dt>",
        "class=\"sideways\"",
        "hemicube-midpoint</code> see the same",
    ] {
        assert!(page.to_lowercase().contains(&said.to_lowercase()), "{said}");
    }
    assert!(!page.contains("NaN") && page.ends_with("</html>\n"));
    let table = room.run(FEW.split(' '));
    assert_eq!(table.code, Some(0), "{table:?}");
    assert!(table.out.contains("progressive") && table.out.contains("light off"), "{}", table.out);
}
