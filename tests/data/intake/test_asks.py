"""What a file does not say is asked for: no quantity, unit, sign or actuator is guessed without a word."""

import re

import openpyxl
import pytest
from raw_files import taken_path

from freelearn.common.errors import UserError
from freelearn.data.intake.convert import convert
from freelearn.data.intake.guesses.draft import draft
from freelearn.data.intake.guesses.guess import guess
from freelearn.data.intake.guesses.joined import guess_file
from freelearn.data.intake.headings import heading
from freelearn.data.intake.laboratory_units import conversion
from freelearn.data.intake.recipes.recipe_file import recipe_of

# Quantity and unit by heading: English, German, French, Italian, Spanish, Japanese; Dutch, Czech, Polish.
ABROAD = {
    "elongation_mm": "Stretch [in]|Dehnung [mm]|Weg/mm|Allongement (mm)|Spostamento [mm]|Desplazamiento (mm)|変位 (mm)"
    "|Verlenging [mm]|Verplaatsing (mm)|Prodloužení [mm]|Posuv [mm]|Wydłużenie [mm]|Przemieszczenie (mm)",
    "twist_deg": "Twist [rad]|Verdrehung [°]|Winkel [Grad]|Angle (°)|Rotazione [gradi]|Ángulo (grados)|ねじれ角（度）"
    "|Verdraaiing [graden]|Hoek (°)|Zkrut [°]|Natočení (°)|Kąt skręcenia [°]|Skręcenie (rad)",
    "pressure_kpa": "Pressure [kg/cm²]|Druck, bar|Pression (bar)|Pressione [bar]|Presión (kPa)|圧力（ＭＰａ）"
    "|Druk [bar]|Overdruk (kPa)|Tlak [kPa]|Přetlak (bar)|Ciśnienie [MPa]|Nadciśnienie [kPa]",
    "force_n": "Force (lbf)|Kraft in N|Force (N)|Forza [N]|Fuerza (N)|荷重（Ｎ）"
    "|Kracht [N]|Trekkracht (N)|Síla [N]|Osová síla [N]|Siła [N]|Siła osiowa (N)",
    "moment_nmm": "Torque [Nm]|Drehmoment [Nm]|Couple (N.m)|Coppia [N·m]|Par (N·m)|トルク [N·m]"
    "|Koppel [Nm]|Draaimoment (Nm)|Krouticí moment [Nm]|Moment skręcający [N·m]",
    "length_mm": "Length [mm]|Länge [mm]|Longueur (mm)|Lunghezza [cm]|Longitud (mm)|長さ (mm)"
    "|Lengte [mm]|Rustlengte (mm)|Délka [mm]|Počáteční délka (mm)|Długość [mm]|Długość początkowa (cm)",
    "strain": "Elongation [%]|Dehnung [%]|Allongement (%)|Deformazione [%]|Deformación (%)|ひずみ (%)"
    "|Rek [%]|Verlenging [%]|Přetvoření [%]|Odkształcenie (%)|Wydłużenie (%)",
    "time_s": "Time (s)|Zeit [s]|Temps (s)|Tempo (s)|Tiempo (s)|時間 (s)|Tijd [s]|Čas [s]|Czas (s)",
    "inner_diameter": "ID [mm]|Innendurchmesser [mm]|Diamètre intérieur (mm)|Diametro interno (mm)|内径 (mm)"
    "|Binnendiameter [mm]|Vnitřní průměr [mm]|Średnica wewnętrzna (mm)",
}


@pytest.mark.parametrize("quantity", ABROAD)
def test_headings_of_nine_languages(quantity):
    for name in ABROAD[quantity].split("|"):
        said = heading(name)
        assert (said.quantity, said.confidence) == (quantity, "sure"), name
        assert said.unit, name


@pytest.mark.parametrize("name", ["Verkorting [mm]", "Zkrácení [mm]", "Skrócenie [mm]", "Verkürzung [mm]"])
def test_what_shortens_is_no_elongation(name):
    assert heading(name).quantity == "shortening"


def test_degrees_in_german_are_no_gons():
    assert conversion("Grad", "deg").factor == pytest.approx(1)
    assert conversion("gon", "deg").factor == pytest.approx(0.9)


@pytest.mark.parametrize(
    ("header", "asks"),
    [
        ("Wert A [mm],P [kPa],F [N]", ["elongation_mm is blank", "twist_deg is blank"]),
        ("dl [mm],P,F [N]", ["columns.pressure_kpa has no unit"]),
    ],
)
def test_a_draft_does_not_convert_before_somebody_has_answered(header, asks):
    content = f"{header}\n0,0,0\n0,50,-4\n5,0,-8\n5,50,-12\n".encode()
    text = draft(guess(content, "raw.csv"))
    with pytest.raises(UserError) as said:
        recipe_of(text, "draft.yaml")
    for sentence in asks:
        assert sentence in str(said.value)


CARDS = "gamma_deg: 25, length_mm: 150, inner_radius_mm: 5, outer_radius_mm: 6, twist_deg: 0"
BY_PRESSURE = [(x, p, -0.5 * p - 2 * x) for p in (0, 50, 100, 150) for x in (0, -5, -10)]


def muscle(rows, sign=""):
    content = "\n".join(["x [mm],P [kPa],F [N]", *(f"{x},{p},{f}" for x, p, f in rows)]).encode()
    text = f"bed: isometric\nconstants: {{{CARDS}}}\ncolumns:\n  elongation_mm: {{from: 'x [mm]', unit: mm}}\n"
    text += f"  pressure_kpa: {{from: 'P [kPa]', unit: kPa}}\n  force_n: {{from: 'F [N]', unit: N{sign}}}\n"
    return convert(recipe_of(text, "r"), {"raw.csv": content}).warnings


def test_the_sign_of_a_pull_is_looked_at():
    rows = sorted(BY_PRESSURE)
    assert not any("pull" in sentence for sentence in muscle(rows))
    assert any(
        "force_n rises with the pressure in 3 of 3 states" in sentence for sentence in muscle(rows, ", sign: -1")
    )


def test_pressures_that_hardly_move_tell_no_sign():
    """Noise alone rises and falls, as where a log stands still."""
    still = [(x, p + 0.01 * k, (-0.5 * p - 2 * x) + 0.1 * k) for x, p, _ in sorted(BY_PRESSURE) for k in range(3)]
    apart = [(x + 1e-3 * n, p, f) for n, (x, p, f) in enumerate(still[::3])]
    held = [(x + 1e-3 * (n // 3), p, f) for n, (x, p, f) in enumerate(still)]
    assert not any("pull" in sentence for rows in (apart, held) for sentence in muscle(rows))


def test_rows_sorted_by_pressure_are_said_and_their_order_drafted():
    assert any("3 states fall into 12" in sentence for sentence in muscle(BY_PRESSURE))
    assert not any("sorted by the pressure" in sentence for sentence in muscle(sorted(BY_PRESSURE)))
    content = "\n".join(["dl [mm],P [kPa],F [N]", *(f"{x},{p},{f}" for x, p, f in BY_PRESSURE)]).encode()
    assert guess(content, "raw.csv").order_by == ("dl [mm]",)


def test_six_muscles_are_not_one():
    rows = [f"{name},{p},{-p}" for name in "abcdef" for p in (0, 50)]
    for column, says in (("Muskel", "samples.6.length_mm is blank"), ("Reihe", "sample is blank")):
        text = draft(guess("\n".join([f"{column},P [kPa],F [N]", *rows]).encode(), "raw.csv"))
        with pytest.raises(UserError, match=says):
            recipe_of(text, "draft.yaml")


def workbook(path, lengths):
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.title = "Messung"
    sheet.append(["Muskel", "Kontraktion [mm]", "Druck [bar]", "Kraft [N]"])
    for name in lengths:
        for x in (0, 5):
            for p in (0, 1, 2):
                sheet.append([name, x, p, -40 * p + 2 * x])
    designs = book.create_sheet("Muskeln")
    designs.append(["Name", "Länge [mm]", "Innendurchmesser [mm]", "Außenradius [mm]", "Faserwinkel [°]"])
    for name, length in lengths.items():
        designs.append([name, length, 10, 6, 25])
    book.save(path)


def test_designs_of_a_sheet_are_joined_by_name(tmp_path):
    workbook(tmp_path / "six.xlsx", {"rot": 150, "blau": 160, "gelb": 170})
    found, joined = guess_file(tmp_path / "six.xlsx")
    text = draft(found, (), joined)
    assert "TODO" in text
    table, _ = taken_path(tmp_path, tmp_path / "six.xlsx", text.replace("twist_deg:   #", "twist_deg: 0   #"))
    assert table.groupby("sample")["length_mm"].first().tolist() == [150, 160, 170]
    assert set(table["inner_radius_mm"]) == {5}
    assert table["elongation_mm"].min() == -5


def test_a_lone_angle_of_a_design_is_that_of_its_fibers_and_what_is_not_used_is_said(tmp_path):
    raw, designs = tmp_path / "raw.csv", tmp_path / "designs.csv"
    raw.write_text("Muscle,dl_mm,P_kPa,F_N\n" + "".join(f"{m},0,{p},{-p}\n" for m in "ab" for p in (0, 50)))
    designs.write_text("id,Length [mm],Radius [mm],Angle [°],Supplier\na,200,10,25,X\nb,180,10,22,Y\n")
    found, joined = guess_file(raw, designs)
    text = draft(found, (), joined)
    assert re.search(r"gamma_deg: .*Angle.*# taken for the fibers' angle", text)
    assert re.search(r"outer_radius_mm: .*Radius.*# taken for the outer radius", text)
    assert "# Not used of the designs: 'Supplier'." in text
    # Where a column says that it is the fibers' angle, another is none.
    designs.write_text("id,Angle [°],Fiber angle [°]\na,3,25\nb,4,22\n")
    found, joined = guess_file(raw, designs)
    text = draft(found, (), joined)
    assert re.search(r"gamma_deg: .*Fiber angle", text)
    assert "# Not used of the designs: 'Angle [°]'." in text


def test_designs_of_a_file_must_name_every_actuator_once(tmp_path):
    raw, designs = tmp_path / "raw.csv", tmp_path / "designs.csv"
    raw.write_text("Muscle,dl_mm,P_kPa,F_N\n" + "".join(f"{m},0,{p},{-p}\n" for m in "ab" for p in (0, 50)))
    designs.write_text("id,L0 [mm],Faserwinkel [°],ID [mm],OD [mm]\nb,160,20,10,12\na,150,25,10,12\n")
    with pytest.raises(UserError, match="names no actuators as raw"):
        guess_file(raw, raw)
    found, joined = guess_file(raw, designs)
    text = draft(found, (), joined).replace("twist_deg:   #", "twist_deg: 0   #")
    table, _ = taken_path(tmp_path, raw, text)
    assert table["length_mm"].tolist() == [150, 150, 160, 160]
    assert table["sample"].tolist() == [2, 2, 1, 1]
    for line, says in (("a,151,25,10,12\n", "stands 2 times"), ("c,151,,10,12\n", "gamma_deg is blank")):
        content = designs.read_text()
        designs.write_text(content + line)
        with pytest.raises(UserError, match=says):
            taken_path(tmp_path, raw, text)
        designs.write_text(content)
    designs.write_text("id,L0 [mm],Faserwinkel [°],ID [mm],OD [mm]\nb,160,20,10,12\n")
    with pytest.raises(UserError, match="no number for 'a'"):
        taken_path(tmp_path, raw, text)
