//! Names of types as a program writes them.

/// A type's name without the paths of its parts, and with nalgebra's vectors and matrices as `Vector3<f64>`,
/// `SVector<f64, 8>`, `Matrix3<f64>` or `SMatrix<f64, 2, 3>`.
pub(crate) fn short(name: &str) -> String {
    let mut rest = without_paths(name);
    let mut text = String::new();
    while let Some((before, size, after)) = matrix_in(&rest) {
        text += &before;
        text += &match size.each_ref().map(String::as_str) {
            [rows, "1"] if rows.len() == 1 && rows <= "6" => format!("Vector{rows}<f64>"),
            [rows, "1"] => format!("SVector<f64, {rows}>"),
            [rows, columns] if rows == columns && rows.len() == 1 && rows <= "6" => {
                format!("Matrix{rows}<f64>")
            }
            [rows, columns] => format!("SMatrix<f64, {rows}, {columns}>"),
        };
        rest = after;
    }
    text + &rest
}

/// The name of a type without the paths of its modules.
pub(crate) fn name_of<T>() -> String {
    without_paths(std::any::type_name::<T>())
}

/// `a::b::C<d::E>` as `C<E>`.
fn without_paths(full: &str) -> String {
    // A path alone, which the compiler looks through in blocks of bytes.
    let in_path = |byte: u8| byte.is_ascii_alphanumeric() | (byte == b'_') | (byte == b':');
    if full.bytes().fold(true, |path, byte| path & in_path(byte)) {
        return full.rsplit(':').next().unwrap_or(full).to_owned();
    }
    let (mut name, mut start) = (String::with_capacity(full.len()), 0);
    for (at, byte) in full.bytes().enumerate() {
        if byte == b':' {
            start = at + 1;
        } else if byte.is_ascii() && !byte.is_ascii_alphanumeric() && byte != b'_' {
            name.push_str(&full[start..=at]);
            start = at + 1;
        }
    }
    name.push_str(&full[start..]);
    name
}

/// The first matrix in a name: what comes before it, its numbers of rows and columns, and what comes after it.
fn matrix_in(name: &str) -> Option<(String, [String; 2], String)> {
    let (before, matrix) = name.split_once("Matrix<f64, Const<")?;
    let (rows, matrix) = matrix.split_once(">, Const<")?;
    let (columns, matrix) = matrix.split_once(">, ")?;
    let after = matrix.strip_prefix(&format!("ArrayStorage<f64, {rows}, {columns}>>"))?;
    Some((before.into(), [rows.into(), columns.into()], after.into()))
}

#[cfg(test)]
mod tests {
    use std::any::type_name;

    use nalgebra::{Matrix3, SMatrix, SVector, Vector1, Vector3};

    use super::*;

    #[test]
    fn a_point_is_named_as_it_is_written() {
        assert_eq!(short(type_name::<Vector3<f64>>()), "Vector3<f64>");
        assert_eq!(short(type_name::<SVector<f64, 10>>()), "SVector<f64, 10>");
        let pair = short(type_name::<(Matrix3<f64>, Vector1<f64>)>());
        assert_eq!(pair, "(Matrix3<f64>, Vector1<f64>)");
        assert_eq!(short(type_name::<SMatrix<f64, 2, 3>>()), "SMatrix<f64, 2, 3>");
        assert_eq!(short(type_name::<Vec<Vector3<f64>>>()), "Vec<Vector3<f64>>");
        assert_eq!(short("f64"), "f64");
    }
}
