use radiosity::session::{Layer, ObjectId, Session};

/// All light of a session, as bits.
pub fn bits(session: &Session) -> Vec<u32> {
    let objects = session.model().objects.len() as u32;
    let of = |object| {
        let light = session.light(object, Layer::Total);
        let cuts = session.light_of_cuts(object, Layer::Total, &light);
        light.into_iter().chain(cuts).chain(session.irradiance(object))
    };
    (0..objects).map(ObjectId).flat_map(of).flatten().map(f32::to_bits).collect()
}
