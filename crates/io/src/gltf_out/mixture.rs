//! A sheet that transmits light, as glTF says it: KHR_materials_diffuse_transmission mixes the reflection of a base colour
//! b and the transmission of a colour c by one factor f for all bands, all of them in 0..1: ρ = (1 − f s) b and τ = f s c,
//! with s the alpha of a picture, where there is one. A `Transmission` has ρ = (1 − r s) b₀ and τ = s t. Without a picture
//! any f from the largest t to 1 − the largest ρ says the same, with b = ρ/(1 − f) and c = t/f. There is none where a band
//! that is mostly reflected stands beside one that mostly passes. With a picture f = r is the only one, unless b₀ is black.

use radiosity_scene::{Bands, Faults, Material};

/// f, b with its alpha, and c.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mixture {
    pub share: f32,
    pub base: [f32; 4],
    pub color: Bands,
}

/// By how much a base colour may be above one: the rounding of a share and its rest.
const ROUNDING: f32 = 4.0 * f32::EPSILON;

/// The mixture that is a material's ρ and τ to the rounding of single precision; nothing for materials that transmit no
/// light and reflect their base colour.
///
/// # Errors
/// In words, where there is no such mixture.
pub(super) fn mixture(material: &Material) -> Result<Option<Mixture>, String> {
    let Some(transmission) = &material.transmission else { return Ok(None) };
    let mut faults = Faults::default();
    material.check_transmission("", &mut faults);
    if let Some(fault) = faults.0.into_iter().next() {
        return Err(fault.what);
    }
    let (tau, replaced) = (transmission.transmittance, transmission.replaced);
    let [r, g, b, alpha] = material.base_color;
    let base = [r, g, b];
    let most = |bands: Bands| bands.into_iter().fold(0.0, f32::max);
    let is_free = transmission.share_texture.is_none() || most(base) == 0.0;
    // As the author said it, where that does.
    let share = if replaced >= most(tau) || !is_free { replaced } else { most(tau) };
    if share == 0.0 && most(tau) == 0.0 {
        return Ok(None);
    }
    let rho = base.map(|c| c * (1.0 - replaced));
    if most(tau) > share {
        return Err(format!(
            "glTF cannot say a transmittance {tau:?} that takes the place of {replaced} of the reflectance where a \
             picture says how much of the sheet transmits; let it take the place of {} at least",
            most(tau)
        ));
    }
    if most(rho) > 1.0 - share + ROUNDING {
        return Err(format!(
            "glTF cannot say a reflectance {rho:?} beside a transmittance {tau:?}: the largest of one and the largest of \
             the other are above 1 together"
        ));
    }
    let kept = |band: usize| match replaced == share {
        true => base[band],
        // In 0..1 but for rounding, as ρ ≤ 1 − f; where f = 1 nothing is reflected, whatever the base.
        false if share < 1.0 => (rho[band] / (1.0 - share)).min(1.0),
        false => 0.0,
    };
    Ok(Some(Mixture { share, base: [kept(0), kept(1), kept(2), alpha], color: tau.map(|t| t / share) }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_scene::{TextureRef, Transmission, Wrap};

    fn sheet(base: Bands, transmittance: Bands, replaced: f32) -> Material {
        let transmission = Transmission { transmittance, replaced, ..Transmission::default() };
        let base_color = [base[0], base[1], base[2], 0.5];
        Material { base_color, transmission: Some(transmission), ..Material::default() }
    }

    fn with_picture(mut material: Material) -> Material {
        let texture =
            TextureRef { texture: 0, uv_set: 0, transform: Default::default(), wrap: [Wrap::Clamp; 2], nearest: false };
        material.transmission.as_mut().unwrap().share_texture = Some(texture);
        material
    }

    /// ρ and τ of what is written are those of the material, with and without a picture of the share, or it is refused.
    #[test]
    fn catalogue_13_mixtures_are_exact_or_refused() {
        let steps = [0.0, 0.1, 0.35, 0.65, 0.9, 1.0];
        let all = steps.into_iter().flat_map(|base| steps.into_iter().flat_map(move |t| steps.map(|r| (base, t, r))));
        let (mut exact, mut refused) = ([0; 2], [0; 2]);
        for (case, (base, tau, replaced)) in all.enumerate() {
            let plain = sheet([base, 0.3, 0.0], [0.2 * tau, tau, 0.2], replaced);
            for (kind, material) in [plain.clone(), with_picture(plain)].into_iter().enumerate() {
                let transmission = material.transmission.clone().unwrap();
                let Ok(mixture) = mixture(&material) else {
                    refused[kind] += 1;
                    continue;
                };
                exact[kind] += 1;
                let Mixture { share, base, color } = mixture.unwrap();
                assert_eq!(base[3], 0.5);
                for band in 0..3 {
                    assert!([base[band], color[band], share].iter().all(|x| (0.0..=1.0).contains(x)), "{case}");
                    for s in [1.0, 0.5, 0.0].into_iter().take(1 + 2 * kind) {
                        let [rho, tau] = [(1.0 - share * s) * base[band], share * s * color[band]];
                        let expected = (1.0 - replaced * s) * material.base_color[band];
                        assert!((rho - expected).abs() < 2e-7, "{case}: {rho} for {expected}");
                        assert!((tau - s * transmission.transmittance[band]).abs() < 2e-7, "{case}: {tau}");
                    }
                }
            }
        }
        assert!(exact.iter().chain(&refused).all(|n| *n > 20), "{exact:?} {refused:?}");
        assert_eq!(mixture(&Material::default()), Ok(None));
    }

    #[test]
    fn a_band_that_reflects_beside_one_that_passes_is_refused() {
        let said = |material: &Material| mixture(material).unwrap_err();
        let red = said(&sheet([0.9, 0.0, 0.0], [0.0, 0.9, 0.0], 0.0));
        assert!(red.contains("[0.9, 0.0, 0.0] beside a transmittance [0.0, 0.9, 0.0]"), "{red}");
        let partly = said(&with_picture(sheet([0.5; 3], [0.4; 3], 0.2)));
        assert!(partly.contains("place of 0.4 at least"), "{partly}");
        let bright = said(&sheet([0.9; 3], [0.9; 3], 0.0));
        assert!(bright.contains("sum to"), "{bright}");
    }
}
