//! Ids of the elements of a [`TriMesh`](super::TriMesh): numbers from 0 that index flat arrays.

use std::fmt;

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
        #[serde(transparent)]
        pub struct $name(pub u32);

        impl $name {
            /// The id of the element at `index` of a flat array.
            #[inline]
            pub fn new(index: usize) -> Self {
                Self(index as u32)
            }

            /// The position of this element in flat arrays.
            #[inline]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }

        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "{}{}", stringify!($name).trim_end_matches("Id").to_lowercase(), self.0)
            }
        }
    };
}

id!(
    /// A vertex of a mesh.
    VertexId
);
id!(
    /// A triangle of a mesh.
    FaceId
);
id!(
    /// A directed side of a triangle of a mesh.
    HalfedgeId
);
id!(
    /// An undirected edge of a mesh.
    EdgeId
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_names_its_kind_and_is_a_plain_number_in_files() {
        assert_eq!(format!("{:?} {:?}", VertexId(3), HalfedgeId(7)), "vertex3 halfedge7");
        assert_eq!(serde_json::to_string(&[FaceId(1), FaceId::new(2)]).unwrap(), "[1,2]");
        assert_eq!(EdgeId::new(9).index(), 9);
    }
}
