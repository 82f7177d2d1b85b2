//! Elements as facets: what form-factor methods for polygons see of a scene.

use crate::{Elements, Enclosure, Facet, FacetError, Mesh, Side};

/// An element that is no polygon.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("element {element} on triangle {triangle}: {error}")]
pub struct ElementError {
    /// The element.
    pub element: usize,
    /// Its mesh triangle.
    pub triangle: usize,
    /// What is wrong.
    #[source]
    pub error: FacetError,
}

impl Enclosure {
    /// The elements of a mesh as facets of the same order, a surface each; those on backs face that way. What is cut out of
    /// triangles or lets light pass counts as opaque.
    ///
    /// # Errors
    /// [`ElementError`] for the first element without area.
    pub fn of_elements(mesh: &Mesh, elements: &Elements) -> Result<Enclosure, ElementError> {
        let mut enclosure = Enclosure::default();
        for element in 0..elements.len() {
            let (triangle, side) = elements.place(element as u32);
            let [a, b, c] = mesh.corners(triangle);
            let corners = elements.corners(element as u32).map(|p| a + p.x * (b - a) + p.y * (c - a));
            // An upright piece and one on its head run opposite ways; the front is the triangle's.
            let facet = Facet::new(corners.to_vec()).map_err(|error| ElementError { element, triangle, error })?;
            let front = mesh.normal(triangle).dot(facet.normal()) > 0.0;
            let facet = if front == (side == Side::Front) { facet } else { facet.flipped() };
            enclosure.add(format!("element {element}"), facet);
        }
        Ok(enclosure)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, Scene};
    use glam::DVec3;

    #[test]
    fn facets_are_where_elements_are() {
        let mut scene = Scene::default();
        scene.materials.push(Material { double_sided: true, ..Material::default() });
        scene.add_triangles("t", 0, &[[DVec3::ZERO, DVec3::X, DVec3::Y]]);
        let mesh = Mesh::new(&scene);
        let elements = Elements::new(&scene, &mesh, 0.2);
        let enclosure = Enclosure::of_elements(&mesh, &elements).unwrap();
        assert_eq!(enclosure.facets.len(), elements.len());
        for (i, facet) in enclosure.facets.iter().enumerate() {
            let element = i as u32;
            assert!((facet.area() - elements.area(&mesh, element)).abs() < 1e-12);
            assert!(facet.normal().distance(elements.normal(&mesh, element)) < 1e-12);
            assert!(facet.centroid().distance(elements.centre(&mesh, element)) < 1e-12);
        }
    }
}
