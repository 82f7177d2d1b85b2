//! Pages of made-up runs: what must be said is said, nothing is fetched, nothing from outside is markup.

use super::*;
use crate::illuminance::{Class, Illuminance, SurfaceLight};
use crate::report::{LightmapReport, SceneReport, SolutionReport, StageReport, TimeReport};
use radiosity::measure::Round;
use radiosity::{Balance, Dim, Faults, Shown};

fn example(rounds: usize) -> Report {
    let round = |i: usize| {
        let seconds = 0.8 * 2.2f64.powi(i as i32);
        let (error, upper) = (0.05 / seconds.sqrt(), 0.06 / seconds.sqrt() + 0.002);
        Round { elements: 10_240, rays: 64 << i, gather: 0, shadow_rays: 64, error, upper, seconds }
    };
    let rounds: Vec<Round> = (0..rounds).map(round).collect();
    let mut faults = Faults::default();
    faults.error("mesh 'A' <b>", "a triangle without area & \"more\"", "remove it");
    faults.warning("material 3", "reflectance 0.97 is high", "plaster reflects 0.8");
    faults.note("camera", "none given", "");
    let last = rounds.last();
    let (estimated, upper) = last.map_or((f64::NAN, f64::INFINITY), |r| (r.error, r.upper));
    let class = |from: f64, to: f64, share| Class { from, to, share, color: [9, 99, 200] };
    let stage = |name: &str, seconds| StageReport { name: name.to_owned(), seconds };
    Report {
        program: "radiosity".to_owned(),
        version: "0.1.0".to_owned(),
        command: ["radiosity", "bake", "my <office>.glb", "--error", "1%", "it's"].map(str::to_owned).to_vec(),
        written: "2025-01-01 00:00 UTC".to_owned(),
        scene: SceneReport {
            name: "scenes/office <script>.glb".to_owned(),
            triangles: 12_345,
            materials: 7,
            lights: vec!["ceiling & wall".to_owned(), "desk lamp".to_owned()],
            other_light: Vec::new(),
            area: 164.2,
        },
        error: ErrorReport {
            asked: 0.01,
            achieved: upper <= 0.01,
            out_of_time: false,
            stalled: false,
            left_open: false,
            estimated,
            upper_95_one_sided: upper,
            lower_95_one_sided: 0.8 * estimated,
            bias: -0.0021,
            bias_standard_error: 0.0006,
            points: last.map_or(0, |_| 1000),
            paths_per_estimate: 256,
            mean_illuminance: 412.0,
            dim: Some(Dim { below: 41.0, share: 0.3, error: 0.1, upper: 0.2, lower: 0.0 }),
            seed: 17,
            solution_estimated: 0.9 * estimated,
            solution_upper_95_one_sided: 0.9 * upper,
            finer: "try more".to_owned(),
        },
        illuminance: Illuminance {
            dark: 0.0,
            low: 3.2,
            mean: 412.0,
            median: 377.0,
            largest: 8210.0,
            classes: vec![class(10.0, 20.0, 0.2), class(20.0, 50.0, 0.7), class(50.0, 100.0, 0.1)],
            surfaces: vec![SurfaceLight {
                name: "desk <i>".to_owned(),
                area: 1.4,
                low: 300.0,
                mean: 500.0,
                largest: 612.0,
            }],
            further_surfaces: 12,
        },
        rounds,
        written_rounds: Vec::new(),
        balance: Balance {
            emitted: [5200.0, 5000.0, 4100.0],
            from_point_lights: [1200.0, 1300.0, 900.0],
            from_sky: [300.0, 400.0, 700.0],
            absorbed: [5900.0, 5800.0, 4900.0],
            escaped: [700.0, 800.0, 750.0],
            lost_on_backs: [60.0, 55.0, 40.0],
            defect: [0.006, 0.0067, 0.0018],
        },
        solution: SolutionReport {
            elements: 10_240,
            element_size: 0.181,
            buried: 120,
            partly_buried: 34,
            cells: 9_000,
            rays_per_cell: 2048,
            raw_closure: 2.2e-16,
            steps: 14,
            relative_residual: vec![3.1e-6; 3],
            guaranteed_bound: vec![0.012, 0.011, 0.009],
            displayed: Shown { delta_e: 0.7, exposure: -6.5 },
        },
        time: TimeReport {
            seconds: 41.5,
            threads: 16,
            stages: vec![stage("elements", 0.2), stage("rays <&>", 14.0), stage("audit", 20.0)],
        },
        peak_memory_mb: Some(812.0),
        lightmap: Some(LightmapReport {
            density: 16.0,
            finest: 64.0,
            reduced_charts: 0,
            texels: 42_000,
            needed: None,
            pages: vec![[1024, 1024], [512, 256]],
            seams_before: 3.4,
            seams_after: 0.12,
        }),
        faults,
        outputs: vec!["out/<a>.png".to_owned()],
        about: figures::ABOUT.iter().copied().collect(),
    }
}

fn sound(html: &str) {
    let mut words = html.split(|c: char| !c.is_alphanumeric());
    assert!(words.all(|word| !["NaN", "inf", "url", "import"].contains(&word)));
    assert!(!html.contains("://"));
    let addresses = html.split("src=\"").skip(1).chain(html.split("href=\"").skip(1));
    assert!(addresses.into_iter().all(|a| a.starts_with("data:image/png;base64,") || a.starts_with('#')));
    for tag in ["section", "table", "tr", "th", "td", "svg", "div", "ul", "li", "dl", "dt", "dd", "p", "figure", "h3"] {
        let opened = html.matches(&format!("<{tag}>")).count() + html.matches(&format!("<{tag} ")).count();
        assert_eq!(opened, html.matches(&format!("</{tag}>")).count(), "{tag}");
    }
}

#[test]
fn text_is_escaped_and_nothing_is_fetched() {
    let plate =
        Plate { title: "View <1> \"a\"".to_owned(), note: "<u>".to_owned(), png: vec![1, 2, 3], has_scale: true };
    let html = page(&example(6), &[plate]);
    sound(&html);
    for wild in ["<script", "<a>", "<1>", "<&>", "<office>", "<u>", "desk <i>"] {
        assert!(!html.contains(wild), "{wild}");
    }
    assert!(html.contains("src=\"data:image/png;base64,AQID\"") && html.contains("View &lt;1&gt; &quot;a&quot;"));
}

#[test]
fn everything_that_was_promised_is_said() {
    let html = page(&example(6), &[]).replace(['\u{a0}', '\u{202f}'], " ");
    for figure in [
        "radiosity bake &#39;my &lt;office&gt;.glb&#39; --error 1% &#39;it&#39;\\&#39;&#39;s&#39;",
        "radiosity 0.1.0",
        "Seed of the audit</dt><dd>17",
        "Asked error",
        "Upper bound",
        "Lower bound",
        "Raw closure</dt><dd>2.2 × 10⁻¹⁶",
        "Residual",
        "3.1 × 10⁻⁶",
        "Guaranteed bound",
        "Energy balance",
        "0.67 %",
        "Relative error against seconds",
        "rays &lt;&amp;&gt;",
        "14 s",
        "Peak memory</dt><dd>812 MB",
        "2025-01-01",
    ] {
        assert!(html.contains(figure), "{figure}");
    }
    for meaning in
        [figures::UPPER, figures::LOWER, figures::CLOSURE, figures::RESIDUAL, figures::BOUND, figures::DEFECT]
    {
        assert!(html.contains(meaning), "{meaning}");
    }
}

#[test]
fn plots_hold_one_round_and_six() {
    for rounds in [1, 6] {
        let svg = plot::convergence(&example(rounds).rounds, 0.01);
        assert_eq!(svg.matches("<circle").count(), 2 * rounds);
        assert_eq!(svg.matches("<line class=\"line").count(), 2 * (rounds - 1));
        sound(&page(&example(rounds), &[]));
    }
}

#[test]
fn values_that_do_not_exist_are_unknown() {
    for value in [0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN_POSITIVE] {
        let mut report = example(3);
        let few = value as f32;
        (report.scene.area, report.time.seconds, report.solution.raw_closure) = (value, value, value);
        let error = &mut report.error;
        (error.asked, error.estimated, error.bias) = (value, value, value);
        (error.upper_95_one_sided, error.lower_95_one_sided) = (value, value);
        report.balance = Balance { emitted: [few; 3], absorbed: [few; 3], defect: [value; 3], ..report.balance };
        let light = &mut report.illuminance;
        (light.low, light.mean, light.largest, light.classes[1].share) = (value, value, value, value);
        (report.time.stages[1].seconds, report.rounds[1].upper) = (value, value);
        (report.rounds[0].seconds, report.rounds[2].error, report.peak_memory_mb) = (value, value, None);
        sound(&page(&report, &[]));
    }
    let nothing = page(&example(0), &[]);
    sound(&nothing);
    assert!(nothing.contains("NOT reached") && nothing.contains("unknown"));
}

#[test]
fn verdict_follows_the_bound() {
    let mut report = example(6);
    assert!(page(&report, &[]).contains("NOT reached"));
    (report.error.asked, report.error.achieved) = (0.05, true);
    assert!(!page(&report, &[]).contains("NOT reached"));
    report.error.upper_95_one_sided = f64::INFINITY;
    assert!(page(&report, &[]).contains("NOT reached"), "a flag without a bound convinces nobody");
    let dimly = "30 % of places have less than 41 lx, a tenth of what this error is relative to";
    assert!(page(&report, &[]).contains(dimly));
}
